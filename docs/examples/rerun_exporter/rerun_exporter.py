"""An exporter of another package: `quadrille export --format rerun` writes cameras, joints and bones for Rerun."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from quadrille import ExportFormat

if TYPE_CHECKING:
    from tracker.interchange.exports.motion import ExportedMotion, ExportOptions


def write(motion: "ExportedMotion", options: "ExportOptions", paths: Sequence[Path], tick: Callable[[], None]) -> None:
    """Write one recording, in the world of the session, in metres."""
    import rerun as rr  # here: help and menus need no viewer

    recording = rr.RecordingStream("quadrille")
    recording.save(paths[0])
    for source in motion.session.cameras:
        camera, T = source.camera.pinhole, source.camera.T_world_camera
        place, pinhole = f"world/{camera.name}", rr.Pinhole(image_from_camera=camera.K, resolution=camera.size)
        recording.log(place, rr.Transform3D(translation=T[:3, 3], mat3x3=T[:3, :3]), pinhole, static=True)
    for frame in motion.frames:
        recording.set_time("frame", sequence=frame)
        recording.set_time("time", duration=motion.time_s(frame))
        for person in motion.exported:
            place = f"world/{person.person.name}"
            if frame not in person.poses:
                recording.log(place, rr.Clear(recursive=True))
                continue
            body = person.body(frame)
            joints, parents = body.joint_centers_world, body.model.parents
            bones = [joints[[parent, i]] for i, parent in enumerate(parents) if parent >= 0]
            recording.log(f"{place}/joints", rr.Points3D(joints, labels=body.model.point_names, show_labels=False))
            recording.log(f"{place}/bones", rr.LineStrips3D(bones))
        tick()
    recording.disconnect()


RERUN = ExportFormat("rerun", "cameras, joints and bones (Rerun)", (".rrd",), write)
