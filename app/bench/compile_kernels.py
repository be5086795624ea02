"""Compile the kernels that are not in the cache: `python -m app.bench.compile_kernels [--background]`.

Numba compiles a kernel on its first call and holds the interpreter lock meanwhile. The first tracking run after an
installation would wait for a minute, and the page with it. This program calls all kernels; other programs then load
them from the cache.
"""

import gc
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import replace

from app.bench.sample_frames import FRAME, read_crowd
from app.session.samples import bundled
from tracker.body.model import BodyModel, PosedBody
from tracker.compute.kernel_cache import compiled_mark, record_compiled
from tracker.contours.label_image import part_labels
from tracker.contours.part_edges import points_occluded
from tracker.errors import SessionError
from tracker.evidence.observer import Observer
from tracker.footage.camera_source import CameraSource
from tracker.footage.recording import Recording
from tracker.geometry.arrays import Array
from tracker.session.lock import SessionLock
from tracker.simulate.people.model_figure import ModelFigure
from tracker.simulate.stage.camera_rig import make_cameras
from tracker.simulate.stage.film import film, freeze
from tracker.simulate.stage.room import see_room
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.chamfer.tracker import ChamferTracker
from tracker.tracking.subjects import Subjects
from tracker.tracking.tracker import TrackingRun

_FRAMES = 3
"""Number of tracked frames: motion and lost limbs exist from the second on."""
_WAIT_S = 0.5
_GC_THRESHOLDS = 50_000, 20, 50
"""Thresholds of the garbage collector: numba makes so many objects that the usual ones cost a sixth of the time."""


def main(background: bool = False) -> None:
    """Compile the missing kernels. While another program compiles them, wait for it.

    Args:
        background: work at the lowest priority.
    """
    if background and hasattr(os, "nice"):
        os.nice(19)
    gc.set_threshold(*_GC_THRESHOLDS)
    mark = compiled_mark()
    if mark.exists():
        mark.touch()  # the versions used last stay in the cache
    while not mark.exists():
        try:
            with SessionLock(mark.parent):
                if not mark.exists():  # another process may have compiled them meanwhile
                    _call_kernels()
                    record_compiled()
        except SessionError:
            time.sleep(_WAIT_S)


def _call_kernels() -> None:
    """Search and track on a few frames of the bundled tango: two people, one as in GD96, one without a background.

    Kernels that tracking does not need follow: labels of the parts, hidden points, the simulator.
    """
    crowd = read_crowd(bundled("tango"), FRAME)
    cameras, settings = crowd.session.cameras, TrackSettings()
    _track(cameras, settings, crowd.models, crowd.values)
    _track(cameras, replace(settings, estimate="search"), crowd.models[:1], crowd.values[:1])
    _track([replace(c, background=None) for c in cameras], settings, crowd.models[:1], crowd.values[:1])
    bodies = [PosedBody(m, v) for m, v in zip(crowd.models, crowd.values, strict=True)]
    part_labels(bodies, cameras[0].camera.pinhole)
    points_occluded(bodies, [cameras[0].camera.pinhole], bodies[0].points_world)
    film(see_room(make_cameras(1, (32, 32), 0)[0], 0), freeze([ModelFigure(crowd.models[0])], crowd.values[:1]))


def _track(
    cameras: Sequence[CameraSource], settings: TrackSettings, models: Sequence[BodyModel], start: Sequence[Array]
) -> None:
    with Recording(cameras) as recording:
        frames = range(FRAME, FRAME + _FRAMES)
        run = TrackingRun(Observer(cameras, recording), Subjects.of(models), start, frames)
        for _ in ChamferTracker(settings).estimates(run):
            pass


if __name__ == "__main__":
    main("--background" in sys.argv[1:])
