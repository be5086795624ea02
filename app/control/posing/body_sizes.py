"""Edit body sizes: first a draft that the views show, then a new model revision, as an entry of the history."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from app.control.search.search_runs import SearchRuns
from app.control.session.activities import Activities
from app.control.session.session_state import SessionState
from app.state.people import SizeDraft
from tracker.body.dimensions import (
    STATED_HEIGHT_SIGMA,
    BodyDimensions,
    PartDimensions,
    dimensions_of,
    mirror_part,
    scaled,
    with_dimensions,
)
from tracker.body.model import BodyModel, PosedBody
from tracker.errors import TrackerError
from tracker.estimation.fitting.retarget import retarget_pose
from tracker.geometry.arrays import Array
from tracker.pipeline.automatic_run import FOLLOWED
from tracker.pipeline.body_acquisition import (
    SIZES_EDITS,
    refitted_record,
    resized_start,
    sizes_changed,
    with_sizes_changed,
)
from tracker.pipeline.body_change import converted_body, joints_off_m
from tracker.session.session import save_model
from tracker.session.store.records import Change, PoseChange
from tracker.session.store.stored_poses import StoredPose


class _Refitted(NamedTuple):
    """Keyframes retargeted to another body."""

    changes: list[Change]
    off_m: float
    """Mean distance between their joints before and after, metres."""


class BodySizeEditing:
    """The body sizes of all people; at most one person's are being edited."""

    def __init__(self, session_state: SessionState, runs: SearchRuns, activities: Activities) -> None:
        """Edit nothing yet.

        Args:
            session_state: holds the state.
            runs: recorded searches, which are discarded when sizes change.
            activities: ends jobs and gestures before an edit.
        """
        self._session_state, self._runs, self._activities = session_state, runs, activities

    def model(self, person: int) -> BodyModel:
        """Return the edited body of a person, else the present one."""
        draft = self._session_state.state.draft
        return draft.model if draft is not None and draft.person == person else self._session_state.present[person]

    def has_former(self, person: int) -> bool:
        """Return whether a person had other sizes before the present ones."""
        with self._session_state.lock:
            return self._session_state.saver.revisions.former_body(person) is not None

    def couple(self, alike: bool) -> None:
        """Choose whether both sides are edited at once."""
        self._session_state.set(sides_alike=alike)

    def set_height(self, person: int, height_m: float) -> None:
        """Scale the draft to another body height, metres.

        Raises:
            TrackerError: the height is out of range.
        """
        with self._session_state.lock:
            sizes = self._sizes(person)
            # Lengths are divided by the height, so it is checked before they are scaled.
            wrong = not (np.isfinite(height_m) and height_m > 0)
            found = sizes._replace(height_m=height_m) if wrong else scaled(sizes, height_m)
            self._draft(person, found, STATED_HEIGHT_SIGMA)

    def set_part(self, person: int, part: str, sizes: PartDimensions) -> None:
        """Give a part of the draft other sizes, and its mirror_part where both sides are edited at once.

        Raises:
            TrackerError: a size is out of range.
        """
        with self._session_state.lock:
            before = self._sizes(person)
            other = mirror_part(part) if self._session_state.state.sides_alike else None
            both = {name: sizes for name in (part, other) if name is not None and name in before.parts}
            self._draft(person, before._replace(parts={**before.parts, **both}))

    def set_width(self, person: int, girdle: str, width_m: float) -> None:
        """Set the width of the hips or shoulders of the draft, metres.

        Raises:
            TrackerError: the width is out of range.
        """
        with self._session_state.lock:
            before = self._sizes(person)
            self._draft(person, before._replace(widths_m={**before.widths_m, girdle: width_m}))

    def recall(self, person: int) -> None:
        """Make the former sizes the draft.

        Raises:
            TrackerError: the person has no former sizes.
        """
        with self._session_state.lock:
            former = self._session_state.saver.revisions.former_body(person)
            if former is None:
                name = self._session_state.session.people[person].name
                raise TrackerError(f"expected sizes that {name} had before, found none; these are the first")
            self._session_state.set(draft=SizeDraft(person, former), sizes_message="")

    def discard(self) -> None:
        """Discard the draft."""
        self._session_state.set(draft=None, sizes_message="")

    def apply(self, person: int, refit: bool) -> None:
        """Make the draft the present body: a new revision and one entry of the history, on disk when this returns.

        Args:
            person: index of the person.
            refit: retarget the person's keyframes to it, by their joints and pins; else stored poses keep their
                bodies.

        Raises:
            TrackerError: there is nothing to change, or the change cannot be written.
        """
        with self._activities.editing(alone=True):
            session_state, name = self._session_state, self._session_state.session.people[person].name
            before, model = session_state.saver.revisions.current(person), self.model(person)
            same = _stated(model) == _stated(session_state.present[person])
            if not same:
                session_state.set_body_models(save_model(session_state.session, person, model))
            draft = session_state.state.draft
            known = draft.poses if draft is not None and draft.person == person else {}
            refitted = self._refit(person, known) if refit else _Refitted([], 0.0)
            if same and not refitted.changes:
                raise TrackerError(
                    f"expected other sizes of {name}, or keyframes made with others, found neither; "
                    "enter a length in the inspector first"
                )
            n = len(refitted.changes)
            counted = f", {n} keyframe{'' if n == 1 else 's'} refitted" if n else ""
            outcome = counted if refit else ", poses kept"
            self._write(f"sizes of {name}{outcome}", refitted.changes, person, before)
            off = f", joints {refitted.off_m * 1000:.0f} mm off on average" if n else ""
            message = f"Applied{outcome}{off}." + ("" if same or not refit else self._rest(person))
            self._runs.clear()
            session_state.show_frame(draft=None, sizes_message=message)
            session_state.refresh_saving()

    def change_body(self, person: int, to: str) -> None:
        """Move a person to another preset: a new revision and one entry of the history; see `pipeline.body_change`.

        Raises:
            TrackerError: the person has this body, or the change cannot be written.
        """
        with self._activities.editing(alone=True):
            session_state, name = self._session_state, self._session_state.session.people[person].name
            before, body = (
                session_state.saver.revisions.current(person),
                converted_body(session_state.session, person, to),
            )
            session_state.set_body_models(save_model(session_state.session, person, body))
            session_state.follow_joints()
            refitted = self._refit(person, {}, with_found=True)
            self._write(f"body of {name}: {body.name}", refitted.changes, person, before)
            n = len(refitted.changes)
            message = f"{name} has the body {body.name}, {n} pose{'' if n == 1 else 's'} refitted."
            n_kept = len(session_state.saver.index.frames(person)) - n
            if n_kept:
                message += f" {n_kept} tracked pose{' keeps' if n_kept == 1 else 's keep'} the former body and "
                message += f"{'is' if n_kept == 1 else 'are'} not shown until tracked again."
            self._runs.clear()
            session_state.show_frame(draft=None, sizes_message=message)
            session_state.refresh_saving()

    def _write(self, label: str, changes: Sequence[Change], person: int, before: int) -> None:
        """Make an entry of the history that changes the body of a person from a revision to the present one."""
        saver, name = self._session_state.saver, self._session_state.session.people[person].name
        edit = saver.write(label, changes, None, by_program=False, even_empty=True)
        if edit is not None and saver.error is None:
            changed = [(name, before, saver.revisions.current(person))]
            saver.store_setting(SIZES_EDITS, with_sizes_changed(saver.setting(SIZES_EDITS, {}), edit, changed))

    def follow(self) -> None:
        """Restore the bodies that belong to the present entry of the history, after a move.

        Raises:
            TrackerError: a body cannot be written.
        """
        session_state, saver = self._session_state, self._session_state.saver
        edits = saver.setting(SIZES_EDITS, {})
        for edit in saver.moves.moved_edits:
            for name, before, after in sizes_changed(edits, edit):
                person = next((i for i, p in enumerate(session_state.session.people) if p.name == name), None)
                if person is not None:
                    self._restore(person, before if saver.moves.is_undone else after)

    def _restore(self, person: int, revision: int) -> None:
        """Make a revision the present body of a person."""
        session_state = self._session_state
        model = session_state.saver.revisions.body(revision)
        if model is not session_state.present[person]:
            session_state.set_body_models(save_model(session_state.session, person, model))
            session_state.follow_joints()
        self._runs.clear()
        session_state.set(draft=None, sizes_message="")

    def _sizes(self, person: int) -> BodyDimensions:
        return dimensions_of(self.model(person))

    def _draft(self, person: int, sizes: BodyDimensions, height_sigma: float | None = None) -> None:
        before = _stated(self.model(person))
        sigma = height_sigma or before[1]
        if (sizes, sigma) == before:
            return
        model = replace(with_dimensions(self._session_state.present[person], sizes), height_sigma=sigma)
        self._session_state.set(draft=SizeDraft(person, model), sizes_message="")

    def _rest(self, person: int) -> str:
        """Return a sentence on the poses of a person that keep their sizes, being no keyframes; may be empty."""
        rows = self._session_state.saver.rows(person, range(self._session_state.session.n_frames))
        n = sum(not row.keyframe for row in rows)
        return f" {n} other pose{' keeps' if n == 1 else 's keep'} the earlier sizes until tracked again." if n else ""

    def _refit(self, person: int, known: Mapping[int, Array], with_found: bool = False) -> _Refitted:
        """Return the keyframes of a person that were made with another body, in the present one.

        Args:
            person: index of the person.
            known: by frame, poses of the present body, (n_values,); other keyframes are retargeted.
            with_found: whether other poses that a run may go out from are retargeted, too.
        """
        session_state, saver = self._session_state, self._session_state.saver
        cameras = [c.camera for c in session_state.session.cameras]
        becomes, name = session_state.present[person], session_state.session.people[person].name
        revision = saver.revisions.current(person)
        changes: list[Change] = []
        off_m: list[float] = []
        for row in saver.rows(person, range(session_state.session.n_frames)):
            is_refitted = row.keyframe or (with_found and row.source not in FOLLOWED)
            record = saver.record(person, row.frame) if is_refitted else None
            if record is None or record.model_revision == revision:
                continue
            was, pins = saver.revisions.body(record.model_revision), saver.pins(person, row.frame)
            stored = StoredPose(PosedBody(was, record.values), record)
            values = known.get(row.frame)
            if values is None:
                values = retarget_pose(record.values, was, becomes, pins, cameras, session_state.active_dofs(person))
            if row.keyframe:
                changes.append(PoseChange(name, row.frame, refitted_record(stored, becomes, values, revision)))
            else:
                changes.append(PoseChange(name, row.frame, resized_start(stored, becomes, revision)))
            off_m.append(joints_off_m(stored.body, PosedBody(becomes, values)))
        return _Refitted(changes, float(np.mean(off_m)) if off_m else 0.0)


def _stated(model: BodyModel) -> tuple[BodyDimensions, float | None]:
    """Return the dimensions of a body, and how sure its height is."""
    return dimensions_of(model), model.height_sigma
