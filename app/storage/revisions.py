"""Model revisions: the bodies that stored poses were made with, and the present bodies of the people."""

from tracker.body.model import BodyModel
from tracker.estimation.fitting.retarget import retarget_pose
from tracker.formats.model_toml import format_model, parse_model
from tracker.geometry.arrays import Array
from tracker.session.session import Session
from tracker.session.store.annotation_store import AnnotationStore


class ModelRevisions:
    """The body models of one session by revision. The caller holds the session's lock."""

    def __init__(self, session: Session, store: AnnotationStore) -> None:
        """Store the present bodies of a session as revisions.

        Args:
            session: the open session.
            store: its annotations.
        """
        self._store = store
        self._bodies: dict[int, BodyModel] = {}
        self._value_counts = store.value_counts()
        self.set_body_models(session)

    def set_body_models(self, session: Session) -> None:
        """Store the bodies of a session's people as revisions: new poses belong to them."""
        self._people = session.people
        self._current = [self._store.add_model_revision(p.name, format_model(p.model)) for p in session.people]
        for revision, person in zip(self._current, session.people, strict=True):
            self._store.require_fit(revision, len(person.model.value_names), self._value_counts)
            self._bodies[revision] = person.model

    def current(self, person: int) -> int:
        """Return the revision of a person's present body, which new poses belong to."""
        return self._current[person]

    def body(self, revision: int) -> BodyModel:
        """Return the body model of a revision: always the same object, so that its cached values are kept."""
        if revision not in self._bodies:
            body = parse_model(self._store.model_revision(revision).toml, f"of the store, revision {revision}")
            self._store.require_fit(revision, len(body.value_names), self._value_counts)
            self._bodies[revision] = body
        return self._bodies[revision]

    def former_body(self, person: int) -> BodyModel | None:
        """Return the body that a person had before the present one; None if no stored body has the same values."""
        current = self._current[person]
        stored = [r.id for r in self._store.model_revisions(self._people[person].name) if r.id != current]
        fitting = [r for r in stored if self.fits(person, r)]
        earlier = [r for r in fitting if r < current] or fitting
        return self.body(earlier[-1]) if earlier else None

    def fits(self, person: int, revision: int) -> bool:
        """Return whether poses of a revision can be shown as this person's: it has the same pose values."""
        return self.body(revision).value_names == self._people[person].model.value_names

    def in_present_body(self, person: int, values: Array, revision: int | None) -> Array:
        """Retarget a pose, (n_values,), of one of a person's revisions to the present body."""
        return values if revision is None else retarget_pose(values, self.body(revision), self._people[person].model)
