"""Cameras and recordings with fisheye lenses, made from those of common lenses."""

import shutil
from dataclasses import replace

import cv2
import numpy as np

from tracker.footage.recording import Recording, read_background
from tracker.footage.video_writer import VideoWriter
from tracker.formats.anipose import write_calibration
from tracker.session.session import load_session

FISHEYE = np.array([-0.02, 0.012, -0.008, 0.001])


def with_fisheye(camera, field_deg=120.0, distortion=FISHEYE):
    """The same camera with a fisheye lens, whose field of view along its longer side is given."""
    focal = max(camera.size) / 2 / np.radians(field_deg / 2)
    K = np.array([[focal, 0.0, camera.K[0, 2]], [0.0, focal, camera.K[1, 2]], [0.0, 0.0, 1.0]])
    return replace(camera, K=K, distortion=np.array(distortion), fisheye=True)


def refilmed(image, source, camera):
    """A picture of one camera as another one in its place films it, (H, W[, C]); black beside the picture."""
    px = np.stack(np.meshgrid(np.arange(camera.width), np.arange(camera.height)), axis=-1).astype(float)
    seen = source.project(camera.center_world + camera.rays(px))
    columns, rows = np.moveaxis(np.nan_to_num(seen, nan=-1e4).astype(np.float32), -1, 0)
    return cv2.remap(image, columns, rows, cv2.INTER_LINEAR)


def refilm_session(source, folder, fields_deg):
    """Copy a session as filmed by fisheye lenses of given fields of view, by the names of the cameras."""
    shutil.copytree(source, folder)
    session, cameras = load_session(folder), []
    for index, old in enumerate(session.cameras):
        field_deg = fields_deg.get(old.camera.name)
        cameras.append(old.camera if field_deg is None else with_fisheye(old.camera, field_deg))
        if field_deg is None:
            continue
        new = folder / "new.mp4"
        with Recording(session.cameras) as recording, VideoWriter(new, old.camera.size, session.fps) as writer:
            for k in range(session.n_frames):
                writer.write(refilmed(recording.read_view(index, k), old.camera, cameras[-1]))
        empty = refilmed(read_background(old), old.camera, cameras[-1])
        cv2.imwrite(str(old.background), empty[..., ::-1])
        new.replace(old.footage)
    write_calibration(folder / "calibration.toml", cameras)
    return folder
