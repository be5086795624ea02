"""The chamfer tracker of GD96: predict, observe, estimate, judge, one frame at a time (see `scene`)."""

from collections.abc import Callable, Iterator, Mapping, Sequence

from tracker.body.model import BodyModel, PosedBody
from tracker.compute.threads import side_by_side
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Region
from tracker.images.static_edges import StaticEdgeModel
from tracker.motion.prediction import PredictSettings
from tracker.tracking.chamfer.frame_estimator import Found, Scene
from tracker.tracking.chamfer.settings import TrackSettings, pose_cost
from tracker.tracking.estimate import OtherPose, PoseEstimate
from tracker.tracking.person_memory import Memory
from tracker.tracking.tracker import TrackingRun
from tracker.tracking.view_regions import confirmed, regions, regions_ahead, visible_outline


def track_forward(run: TrackingRun, settings: TrackSettings) -> Iterator[PoseEstimate]:
    """Track all people frame by frame, in the order of `run.frames`.

    Yields:
        The poses of each frame.
    """
    observer, subjects, frames, models = run.observer, run.subjects, run.frames, run.subjects.models
    several = len(models) > 1
    memories = [
        Memory(m, start, active, alone=not several)
        for m, start, active in zip(models, run.start, subjects.active_dofs, strict=True)
    ]
    static_edges = [StaticEdgeModel(c.size) for c in observer.working_cameras] if settings.segments else None
    cameras, ahead = observer.working_cameras, list[Region | None]()

    def placed(frame: int, expected: Callable[[Memory, PredictSettings], Array]) -> list[PosedBody]:
        """Everybody on a frame, where they are given or expected."""
        given = subjects.keyframes_at(frame)
        poses = [
            given.get(p, expected(m, settings.predict) if p in subjects.tracked else m.past[-1])
            for p, m in enumerate(memories)
        ]
        return [PosedBody(m, v) for m, v in zip(models, poses, strict=True)]

    for i, frame in enumerate(frames):
        if i == 0:  # who goes on from known poses looks where who never stopped would have
            if several and all(len(m.past) > 1 for m in memories):
                ahead = regions_ahead(cameras, placed(frame, Memory.was_expected))
            observer.prefetch(frame, ahead or None, with_static_edges=static_edges is not None)
        given, bodies = subjects.keyframes_at(frame), placed(frame, Memory.expected)
        sought, poses = [p for p in subjects.tracked if p not in given], [b.values for b in bodies]
        where = confirmed(ahead, cameras, bodies) if ahead else regions(cameras, bodies)
        following = frames[i + 1 : i + 2]
        for k in following if several else ():
            ahead = regions_ahead(cameras, placed(k, Memory.expected_ahead))
            observer.prefetch(k, ahead, with_static_edges=static_edges is not None)
        outlines = [visible_outline(bodies, c) for c in cameras] if settings.segments else None
        views = observer.evidence(frame, where, outlines, static_edges)
        for k in () if several else following:  # of one alone no sooner: all cores were busy with this frame
            observer.prefetch(k)
        scene = Scene(views, memories, poses, settings)
        estimates = scene.estimate(sought)
        found = [estimates[p] if p in estimates else scene.held(p) for p in range(len(models))]
        _remember(memories, scene, found, given)
        if static_edges is not None:
            scene.teach(static_edges)
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
        settings.method,
    )  # fmt: skip


def _remember(memories: Sequence[Memory], scene: Scene, found: Sequence[Found], given: Mapping[int, Array]) -> None:
    """Have everybody's memory take in what a frame brought; `given` are the poses that a person set."""

    def remember(p: int) -> None:
        memories[p].update(scene.poses[p], scene.colors(p), found[p].status, given=p in given)

    side_by_side(remember, range(len(memories)))
