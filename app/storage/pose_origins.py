"""Origins of stored poses: read for the page, which shows that of one pose."""

from collections.abc import Sequence
from dataclasses import dataclass

from tracker.body.model import BodyModel
from tracker.interchange.exports.provenance import PointOrigin, point_origins
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.calibration_log import present_revision, revisions_of_poses
from tracker.session.store.records import PoseRecord


@dataclass(frozen=True, eq=False)
class PoseOrigin:
    """Origin of the stored pose of a person in a frame."""

    record: PoseRecord
    """The pose; author and time are those of the edit that made or marked it."""
    model: BodyModel
    """Its body."""
    points: tuple[PointOrigin, ...]
    """Of each point of the body, in the order of its `point_names`."""
    calibration_revision: int
    """The calibration that it was made with, from 1."""
    present_calibration: int


def read_origin(store: AnnotationStore, person: str, frame: int, model: BodyModel) -> PoseOrigin | None:
    """Return the origin of the stored pose of a person; None if there is none.

    Args:
        store: annotations of the session.
        person: name.
        frame: the frame.
        model: the body of the pose.

    Raises:
        SessionError: the annotations cannot be read.
    """
    versions = store.pose_versions(person, frame)
    if not versions or len(versions[0].values) != len(model.value_names):
        return None
    points = point_origins(model, versions, store.pins(person, frame))
    present = present_revision(store)
    revision = 1 if present is None else revisions_of_poses(store, person).get(frame, 1)
    return PoseOrigin(versions[0], model, points, revision, present or 1)


def keyframes_by_annotator(store: AnnotationStore, people: Sequence[str]) -> tuple[dict[str, tuple[int, ...]], ...]:
    """Return for each person the keyframes by the annotator who set or marked them last, ascending.

    Raises:
        SessionError: the annotations cannot be read.
    """
    found: dict[str, dict[str, list[int]]] = {name: {} for name in people}
    for made in store.tasks.makers_of_poses():
        if made.keyframe and made.person in found:
            found[made.person].setdefault(made.author, []).append(made.frame)
    return tuple({author: tuple(sorted(frames)) for author, frames in sorted(of.items())} for of in found.values())
