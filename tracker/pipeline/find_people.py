"""Find people automatically, and store their first poses. The chain acquires their sizes, and tracks from there."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tracker.compute.progress import Report, unreported
from tracker.errors import TrackerError
from tracker.estimation.initialization.first_pose import FirstPose, FirstPoses, fit_to_contours
from tracker.estimation.initialization.frame_trials import Show, Trying, find_first_poses, find_first_poses_anywhere
from tracker.evidence.observer import Observer
from tracker.evidence.voxels.voxel_grid import VOXEL_M
from tracker.formats.model_toml import format_model
from tracker.interchange.observations.stored import list_observations
from tracker.pipeline.body_acquisition import MEASURED, SIZES_EDITS, with_sizes_changed
from tracker.pipeline.keypoint_evidence import MAX_FRAMES, find_by_keypoints
from tracker.session.session import Session, save_model
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange, PoseRecord

FINDING = "finding first poses"
"""The stage of the search, for progress."""
AXES = "silhouette_axes"
"""Setting of the session: the `frame` on which people were found, and the `lines` of the silhouettes' axes by camera.
For each person these are the successive approximations, as ends x, y in undistorted px (GD96 Fig. 5)."""


@dataclass(frozen=True)
class FindSettings:
    """Settings of the search for people."""

    frame: int | None = None
    """One of the frames to try; None for the middle of the recording, where people are seen from all sides."""
    generator: str | None = None
    """The generator of starts, which is tried on that frame alone; None for all on several frames."""
    voxel_m: float = VOXEL_M
    """Edge of a voxel, metres."""
    keypoints: str | None = None
    """Name of the observations whose key points show the people. None for those of the session, and for the silhouettes
    where these show no start that fits the contours."""


def frames_to_try(frames: Sequence[int], first: int | None) -> list[int]:
    """Return frames spread evenly, each new one as far as possible from those before.

    Args:
        frames: that may be tried, ascending.
        first: frame to try first; None for the middle one.
    """
    begin = frames[len(frames) // 2] if first is None else first
    # Midpoints of equal parts: on the first and last frame a start is tracked in one direction only.
    n = min(MAX_FRAMES, len(frames))
    indices = ((np.arange(n) + 0.5) * len(frames) / n).astype(int)
    spread = sorted({frames[i] for i in indices} - {begin})
    order = [begin]
    while spread:
        farthest = max(spread, key=lambda k: min(abs(k - other) for other in order))
        spread.remove(farthest)
        order.append(farthest)
    return order[:MAX_FRAMES]


def find_people(
    session: Session, observer: Observer, people: Sequence[int], frames: Sequence[int], settings: FindSettings,
    report: Report = unreported, show: Show = lambda trying: None,
) -> FirstPoses:  # fmt: skip
    """Find the first poses of people, all on one frame. Nothing is stored; see `store_found`.

    Args:
        session: the session.
        observer: of its recording.
        people: indices of the people to find.
        frames: the frames that may be used.
        settings: of the search.
        report: shows progress.
        show: shows each frame that is tried, and the best first poses so far.

    Raises:
        TrackerError: no frame shows the people well enough.
    """
    if settings.generator is not None and settings.frame is not None:
        by = (settings.generator,)
        return find_first_poses(session, observer, people, [settings.frame], by, settings.voxel_m)
    tried = frames_to_try(frames, settings.frame)
    share = 0.0

    def say(text: str) -> None:
        report(FINDING, share, text)

    def go_on() -> None:
        say("")

    def shown(trying: Trying) -> None:
        nonlocal share
        share = trying.share
        go_on()
        show(trying)

    go_on()
    by_points = None
    for name in list_observations(session) if settings.keypoints is None else [settings.keypoints]:
        try:
            first_poses = fit_to_contours(session, observer, find_by_keypoints(session, people, frames, name), go_on)
        except TrackerError:
            if settings.keypoints is not None:
                raise
            continue
        if first_poses.is_good or settings.keypoints is not None:
            return first_poses
        by_points = by_points or first_poses
    try:
        first_poses = find_first_poses_anywhere(session, observer, people, tried, settings.voxel_m, say, shown)
    except TrackerError:
        if by_points is None:
            raise
        return by_points
    return first_poses if first_poses.is_good or by_points is None else by_points


def first_record(first: FirstPose, revision: int) -> PoseRecord:
    """Return the stored form of a first pose.

    Args:
        first: the pose.
        revision: of the person's body.
    """
    pose, settings = first.start.pose, {"method": first.start.source, MEASURED: first.start.is_measured}
    remark = "; ".join(first.notes)
    return PoseRecord(pose, ("searched",) * len(pose), revision, status=first.status, settings=settings, remark=remark)


def axes_record(found: FirstPoses) -> dict[str, Any]:
    """Return the frame and the major axes of all silhouettes on it, as the setting `AXES` holds them."""
    lines: dict[str, list[Any]] = {}
    for first in found.poses.values():
        for name, own in first.lines_px.items():
            lines.setdefault(name, []).append(np.round(own, 1).tolist())
    return {"frame": found.frame, "lines": lines}


def store_found(session: Session, store: AnnotationStore, found: FirstPoses, label: str = "find people") -> Session:
    """Store the first poses and the bodies of people as one undoable edit; return the session with the bodies.

    Args:
        session: the session, which this process has locked.
        store: its annotations.
        found: the people.
        label: of the entry of the history.
    """
    sizes, changes = [], []
    for person, first in found.poses.items():
        who = session.people[person]
        before = store.add_model_revision(who.name, format_model(who.model))
        if format_model(first.model) != format_model(who.model):
            session = save_model(session, person, first.model)
        revision = store.add_model_revision(who.name, format_model(first.model))
        changes.append(PoseChange(who.name, found.frame, first_record(first, revision)))
        if revision != before:
            sizes.append((who.name, before, revision))
    edit = store.commit(f"{label}, frame {found.frame}", changes).edit
    store.set_setting(AXES, axes_record(found))
    if sizes:
        store.set_setting(SIZES_EDITS, with_sizes_changed(store.setting(SIZES_EDITS, {}), edit, sizes))
    return session


def sentences(session: Session, found: FirstPoses) -> list[str]:
    """Return a sentence on each first pose, and on its doubts."""
    out = []
    for person, first in found.poses.items():
        name = session.people[person].name
        cost = f", {first.status}, cost {first.cost_px:.2f} px over a short track"
        out.append(
            f"{name}: started on frame {found.frame} by {first.start.source}, {first.model.height_m:.2f} m tall"
            + cost * bool(np.isfinite(first.cost_px))
        )
        out += [f"{name}: {note}" for note in first.notes]
    return out
