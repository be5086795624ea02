"""Read the stored poses of a person in the bodies that they were made with."""

from dataclasses import dataclass
from pathlib import Path

from tracker.body.model import BodyModel, PosedBody
from tracker.formats.model_toml import format_model, parse_model
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import ALL_FRAMES, SOURCES, PoseRecord


@dataclass(frozen=True, eq=False)
class StoredPose:
    """A stored pose, in the body that it was made with."""

    body: PosedBody
    record: PoseRecord

    @property
    def source(self) -> str:
        """The most manual source of its values."""
        return min(self.record.sources, key=SOURCES.index)


def read_stored_poses(path: Path, person: str, model: BodyModel, frames: range = ALL_FRAMES) -> dict[int, StoredPose]:
    """Return the poses of a person by frame, each in the body of its model revision.

    The dimensions of a body may have changed since. Poses of the present body share its model.

    Args:
        path: the annotations, which other programs may have open; without the file there are no poses.
        person: name.
        model: the person's present body.
        frames: the frames; all by default.

    Raises:
        SessionError: the annotations cannot be read.
        ModelError: a stored body model is malformed.
    """
    if not path.exists():
        return {}
    with AnnotationStore(path, read_only=True) as store:
        records = store.poses(person, frames)
        tomls = {r: store.model_revision(r).toml for r in {record.model_revision for record in records.values()}}
        present = format_model(model)
        models = {
            revision: model if toml == present else parse_model(toml, f"of '{person}', revision {revision}")
            for revision, toml in tomls.items()
        }
        counts = store.value_counts()
        for revision, body in models.items():
            store.require_fit(revision, len(body.value_names), counts)
    return {
        frame: StoredPose(PosedBody(models[record.model_revision], record.values), record)
        for frame, record in records.items()
    }
