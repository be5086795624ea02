"""Compile the kernels that are not in the cache: `python -m app.bench.compile_kernels [--background] [--times]`.

Numba compiles a kernel on its first call and holds the interpreter lock meanwhile. The first tracking run after an
installation would wait for a minute, and the page with it. This program calls all kernels; other programs then load
them from the cache. The kernels that a new user meets first come first (`kernel_cache.STAGES`).
"""

import gc
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from app.session.samples import bundled
from tracker.body.model import BodyModel, PosedBody
from tracker.compute.kernel_cache import compiled_mark, record_compiled, record_stage
from tracker.compute.progress import result_of
from tracker.errors import SessionError
from tracker.estimation.posing.default_pose import default_pose
from tracker.estimation.posing.drag import drag
from tracker.estimation.posing.grab import grab
from tracker.estimation.search.chamfer_cost import ChamferCost, compile_measure_kernels
from tracker.evidence.contours import occluding_contours
from tracker.evidence.contours.part_edges import points_occluded
from tracker.evidence.observer import open_observer
from tracker.footage.camera_source import CameraSource
from tracker.footage.recording import Recording
from tracker.geometry.arrays import Array
from tracker.session.lock import SessionLock
from tracker.session.session import Session, load_session
from tracker.system import lower_priority, start_child

if TYPE_CHECKING:
    from tracker.estimation.chamfer.settings import TrackSettings

_FRAME = 25
_FRAMES = 3
"""Number of tracked frames: motion and lost limbs exist from the second on."""
_VOXEL_M = 0.05
_WAIT_S = 0.5
_GC_THRESHOLDS = 50_000, 20, 50
"""Thresholds of the garbage collector: numba makes so many objects that the usual ones cost a sixth of the time."""


def main(background: bool = False, times: bool = False) -> None:
    """Compile the missing kernels. While another program compiles them, wait for it.

    Args:
        background: work beside a page: at the lowest priority after what its first cost needs, and on two cores.
        times: print the processor time and the time by the clock at which each stage is compiled, s.
    """
    began = time.perf_counter()

    def reached(stage: str) -> None:
        if times:
            print(stage, time.process_time(), time.perf_counter() - began, flush=True)

    gc.set_threshold(*_GC_THRESHOLDS)
    mark = compiled_mark()
    if mark.exists():
        mark.touch()  # the versions used last stay in the cache
    while not mark.exists():
        try:
            with SessionLock(mark.parent):
                if not mark.exists():  # another process may have compiled them meanwhile
                    _call_kernels(background, reached)
                    record_compiled()
                    reached("all")
        except SessionError:
            time.sleep(_WAIT_S)


def _call_kernels(background: bool, reached: Callable[[str], None]) -> None:
    """Call the kernels stage by stage on the bundled tango: two people in four views.

    In the background, a second process compiles the kernels of the evidence, at the priority of the page: its first
    cost waits for them, while it interprets what places bodies and traces contours. Then that process compiles those
    that measure contours. It is a copy of this one where the system has them:
    importing the program takes as long as a tenth of its work.
    """
    session = load_session(bundled("tango"))
    beside = start_child(_compile_evidence, session, background) if background else None
    if beside is not None:
        lower_priority()
    try:
        bodies = _compile_posing(session)
        cameras = [c.camera for c in session.cameras]
        occluding_contours.trace(bodies, cameras[0].pinhole)
        points_occluded(bodies, [cameras[0].pinhole], bodies[0].points_world)
        record_stage("contours")
    finally:
        if beside is not None:
            beside.join()
    if beside is None or beside.exitcode:
        _compile_evidence(session, background)
    with open_observer(session.cameras) as observer:
        ChamferCost(observer.evidence(_FRAME), bodies).at_prediction()
    record_stage("cost")
    reached("cost")
    _call_tracking(session)
    record_stage("tracking")
    _call_others(session)


def _compile_posing(session: Session) -> list[PosedBody]:
    """Compile the kernels that place and drag a body; return the people in their default poses."""
    cameras = [c.camera for c in session.cameras]
    bodies = [PosedBody(p.model, default_pose(p.model, cameras, np.eye(3), 0.0)) for p in session.people]
    drag(grab(bodies[0].model, bodies[0].values, cameras[0], "left_wrist", np.zeros(2)), np.ones(2), bodies[0].values)
    record_stage("posing")
    return bodies


def _compile_evidence(session: Session, background: bool) -> None:
    """Compile the kernels of the evidence, and those that measure contours against it."""
    with open_observer(session.cameras) as observer:
        views = observer.evidence(_FRAME)
    record_stage("evidence")
    if background:
        lower_priority()
    compile_measure_kernels(views, tuple(p.model for p in session.people))


def _call_tracking(session: Session) -> None:
    """Search and track on a few frames: two people, one as in GD96, one without a background."""
    # Imported here: most of the program, which the page's first kernels do not wait for.
    from app.bench.sample_frames import read_crowd
    from tracker.estimation.chamfer.settings import TrackSettings

    crowd, cameras, settings = read_crowd(session.folder, _FRAME), session.cameras, TrackSettings()
    _track(cameras, settings, crowd.models, crowd.values)
    _track(cameras, replace(settings, estimate="search"), crowd.models[:1], crowd.values[:1])
    _track([replace(c, background=None) for c in cameras], settings, crowd.models[:1], crowd.values[:1])
    _estimate(cameras, settings, session.fps, crowd.models[:1], crowd.values[:1])


def _call_others(session: Session) -> None:
    """Call the kernels that the chamfer tracker does not need.

    They label parts in an image, carve and label voxels, compare bodies with silhouettes, film simulated people, learn
    what is usual in a run, and check its cameras.
    """
    from tracker.estimation.acquisition.part_derivatives import N_MOTIONS
    from tracker.estimation.acquisition.piece_sums import sums_of_views
    from tracker.estimation.by_frame.part_evidence import learn_usual_evidence
    from tracker.estimation.fitting.contour_residuals import ContourResiduals
    from tracker.estimation.initialization.generators.silhouette_overlap import SilhouetteOverlap
    from tracker.estimation.voxel.body_pose import state_of
    from tracker.estimation.voxel.labels import label_voxels
    from tracker.estimation.voxel.settings import VoxelSettings
    from tracker.evidence.contours.label_image import part_labels
    from tracker.evidence.silhouettes import SilhouetteFinder
    from tracker.evidence.voxels.carving import Carver
    from tracker.evidence.voxels.voxel_grid import VoxelGrid
    from tracker.geometry.cameras import viewed_point
    from tracker.simulate.people.model_figure import ModelFigure
    from tracker.simulate.stage.camera_rig import make_cameras
    from tracker.simulate.stage.film import film, freeze
    from tracker.simulate.stage.room import see_room

    model, sources = session.people[0].model, session.cameras[:2]  # each more view would take half a second
    cameras = [c.camera for c in sources]
    body, middle = PosedBody(model, default_pose(model, cameras)), viewed_point(cameras)
    part_labels([body], cameras[0].pinhole)
    film(see_room(make_cameras(1, (32, 32), 0)[0], 0), freeze([ModelFigure(model)], [body.values]))
    with Recording(sources) as recording, closing(SilhouetteFinder(sources, recording)) as finder:
        silhouettes = finder.silhouettes(_FRAME)
    Carver(silhouettes).carve(VoxelGrid.over(middle - 1.0, middle + 1.0, _VOXEL_M))
    settings = VoxelSettings()
    label_voxels(middle[None], [state_of(model, [body.values], 0.04, settings)], _VOXEL_M, settings.label_rule)
    overlap = SilhouetteOverlap(model, [s.mask for s in silhouettes], [s.camera for s in silhouettes], middle)
    overlap.added(body.kinematics.Ts_world_part[None], np.arange(len(model.parts)), overlap.nothing())
    with open_observer(sources) as observer:
        frames = [(k, (body,)) for k in range(_FRAME, _FRAME + _FRAMES)]
        learn_usual_evidence(observer, frames)
        (view, *_) = observer.evidence(_FRAME)
    _, pieces = ContourResiduals([view], [body]).piece_sums(body.kinematics)
    sums_of_views([(view.camera, pieces)], model, body.kinematics, N_MOTIONS)


def _track(
    cameras: Sequence[CameraSource], settings: "TrackSettings", models: Sequence[BodyModel], start: Sequence[Array]
) -> None:
    from tracker.estimation.chamfer.tracker import ChamferTracker
    from tracker.estimation.tracking.tracker import Subjects, TrackingRun

    with open_observer(cameras) as observer:
        run = TrackingRun(observer, Subjects.of(models), start, range(_FRAME, _FRAME + _FRAMES))
        for _ in ChamferTracker(settings).estimates(run):
            pass


def _estimate(
    cameras: Sequence[CameraSource], settings: "TrackSettings", fps: float, models: Sequence[BodyModel],
    poses: Sequence[Array],
) -> None:  # fmt: skip
    """Estimate the poses of a few frames together, and search a limb on one."""
    from tracker.body.limbs import limbs
    from tracker.estimation.appearance.region_model import LearningFrame, learn_regions
    from tracker.estimation.by_frame.limb_recovery import search_limbs
    from tracker.estimation.by_frame.pose_score import FrameEvidence, common_evidence
    from tracker.estimation.runs.frame_hypotheses import FrameHypotheses
    from tracker.estimation.runs.run_estimate import RunFrames, estimate_run
    from tracker.estimation.tracking.tracker import Subjects

    bodies = tuple(PosedBody(m, pose) for m, pose in zip(models, poses, strict=True))
    with open_observer(cameras) as observer:
        views = common_evidence(observer, _FRAME, [bodies], settings)
        known = learn_regions([LearningFrame(views, bodies)], observer.working_cameras, observer.empty_scenes())
        frame = known.frame(views, bodies)
        known.score(frame, bodies)
        at = FrameHypotheses(FrameEvidence(views, known, frame), bodies, 0, settings)
        scorer = at.limb_scorer(poses[0], at.part_colors(poses[0]))
        search_limbs(models[0], limbs(models[0])[-1:], scorer.fitted(models[0], poses[0]), (), scorer)
        known_poses = dict.fromkeys(range(_FRAME, _FRAME + _FRAMES), poses)
        result_of(estimate_run(RunFrames(observer, Subjects.of(models), settings, fps, known_poses)))


if __name__ == "__main__":
    main("--background" in sys.argv[1:], "--times" in sys.argv[1:])
