"""The chamfer tracker of GD96: predict, observe, estimate, judge, one frame at a time (see `scene`)."""

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody
from tracker.compute.threads import side_by_side
from tracker.evidence.observer import Observer
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Region
from tracker.images.static_edges import Scenery
from tracker.motion.prediction import PredictSettings
from tracker.tracking.chamfer.frame_estimator import Found, Scene
from tracker.tracking.chamfer.settings import TrackSettings, pose_cost
from tracker.tracking.estimate import OtherPose, PoseEstimate
from tracker.tracking.person_memory import Memory
from tracker.tracking.view_regions import confirmed, regions, regions_ahead, visible_outline


def track_chamfer(
    observer: Observer,
    models: Sequence[BodyModel],
    start: Sequence[Array | Sequence[Array]],
    frames: Sequence[int],
    settings: TrackSettings,
    fixed: Mapping[int, Mapping[int, Array]] | None = None,
    people: Sequence[int] | None = None,
    free: Sequence[NDArray[np.bool_]] | None = None,
) -> Iterator[PoseEstimate]:
    """Track all people frame by frame.

    Args:
        observer: gives the evidence of a frame.
        models: the body of each person.
        start: of each person the pose from which the first frame is predicted, (n_values,), or the poses of the frames
            before it, the last one last, (n, n_values).
        frames: the frames in the order of tracking.
        settings: of the tracker.
        fixed: poses that stay as they are (keyframes), by frame and person; tracking goes on from them.
        people: whom to track; everybody by default. The others stand as they are in `start` or `fixed`.
        free: of each person the degrees of freedom that may move, (n_dofs,); all by default. The others stay as they
            are in `start`, or in the last of `fixed`.

    Yields:
        The poses of each frame.
    """
    everybody = tuple(range(len(models))) if people is None else tuple(people)
    masks = [None] * len(models) if free is None else list(free)
    several = len(models) > 1
    memories = [Memory(m, s, mask, alone=not several) for m, s, mask in zip(models, start, masks, strict=True)]
    scenery = [Scenery(c.size) for c in observer.matched_cameras] if settings.segments else None
    cameras, ahead = observer.matched_cameras, list[Region | None]()

    def placed(frame: int, expected: Callable[[Memory, PredictSettings], Array]) -> list[PosedBody]:
        """Everybody on a frame, where they are given or expected."""
        given = (fixed or {}).get(frame, {})
        poses = [
            given.get(p, expected(m, settings.predict) if p in everybody else m.past[-1])
            for p, m in enumerate(memories)
        ]
        return [PosedBody(m, v) for m, v in zip(models, poses, strict=True)]

    for i, frame in enumerate(frames):
        if i == 0:  # who goes on from known poses looks where who never stopped would have
            if several and all(len(m.past) > 1 for m in memories):
                ahead = regions_ahead(cameras, placed(frame, Memory.was_expected))
            observer.prefetch(frame, ahead or None, still=scenery is not None)
        given, bodies = (fixed or {}).get(frame, {}), placed(frame, Memory.expected)
        sought, poses = [p for p in everybody if p not in given], [b.values for b in bodies]
        where = confirmed(ahead, cameras, bodies) if ahead else regions(cameras, bodies)
        following = frames[i + 1 : i + 2]
        for k in following if several else ():
            ahead = regions_ahead(cameras, placed(k, Memory.expected_ahead))
            observer.prefetch(k, ahead, still=scenery is not None)
        outlines = [visible_outline(bodies, c) for c in cameras] if settings.segments else None
        views = observer.evidence(frame, where, outlines, scenery)
        for k in () if several else following:  # of one alone no sooner: all cores were busy with this frame
            observer.prefetch(k)
        scene = Scene(views, memories, poses, settings)
        estimates = scene.estimate(sought)
        found = [estimates[p] if p in estimates else scene.held(p) for p in range(len(models))]
        _remember(memories, scene, found, given)
        if scenery is not None:
            scene.teach(scenery)
        yield summed_up(frame, views, models, scene.poses, found, settings)


def summed_up(
    frame: int, views: Sequence[ViewEvidence], models: Sequence[BodyModel], poses: Sequence[Array],
    found: Sequence[Found], settings: TrackSettings,
) -> PoseEstimate:  # fmt: skip
    """What is told of a frame on which everybody was found.

    Args:
        frame: its number.
        views: its evidence.
        models: the body of each person.
        poses: where each stands, (n_values,).
        found: of each what was found.
        settings: of the tracker.
    """
    cost_of = pose_cost(views, models, poses, settings)
    cost = cost_of(poses)
    others = [[OtherPose(rival[p], cost_of(rival).total_px) for rival in f.others] for p, f in enumerate(found)]
    return PoseEstimate(
        frame, tuple(poses), cost.total_px, cost.views_px, sum(f.evaluations for f in found),
        tuple(f.status for f in found), tuple(f.remark for f in found), tuple(f.parts_px for f in found),
        tuple(f.covariance for f in found), tuple(f.quality for f in found), tuple(map(tuple, others)),
    )  # fmt: skip


def _remember(memories: Sequence[Memory], scene: Scene, found: Sequence[Found], given: Mapping[int, Array]) -> None:
    """Have everybody's memory take in what a frame brought; `given` are the poses that a person set."""

    def remember(p: int) -> None:
        memories[p].update(scene.poses[p], scene.colors(p), found[p].status, given=p in given)

    side_by_side(remember, range(len(memories)))
