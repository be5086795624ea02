"""Find a moment at which something moves fast in two views, by which a person can compare their clocks."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from tracker.compute.progress import Report, unreported
from tracker.errors import TrackerError
from tracker.footage.flash import tiles
from tracker.footage.recording import Recording
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera
from tracker.interchange.observations.stored import list_observations, load_observations
from tracker.pipeline.posed_recording import N_FRAMES
from tracker.session.session import Session
from tracker.session.store.stored_poses import read_stored_poses


class FastMoment(NamedTuple):
    """A frame on which a point moves fast in two views."""

    frame: int
    """Frame of the session."""
    centers_px: tuple[tuple[float, float], ...]
    """Place of the point in each view, undistorted px."""
    source: str
    """Kind of data by which it was found, for display."""


def find_fast_moment(
    session: Session, recording: Recording, views: Sequence[int], report: Report = unreported
) -> FastMoment:
    """Return the frame with the fastest motion of stored poses, else of key points, else of the pictures.

    A motion is as fast as in the view that shows it slower. Its second difference is subtracted from its speed, so that
    a point that jumps for a frame, or changes its person, is not fast.

    Args:
        session: of the footage.
        recording: its footage.
        views: indices of two cameras.
        report: shows progress. An exception that it raises ends the search.

    Raises:
        TrackerError: nothing moves in both views.
        RecordingError: footage cannot be read.
    """
    cameras = [session.cameras[i].camera for i in views]
    for source, paths in (
        ("tracked joints", _joint_paths(session, cameras)), ("key points", _keypoint_paths(session, views))
    ):  # fmt: skip
        moments = [m for m in map(_fastest, paths) if m is not None]
        if moments:
            _, frame, centers = max(moments, key=lambda m: m[0])
            return FastMoment(frame, centers, source)
    fastest = max(_picture_changes(recording, cameras, views, report), key=lambda m: m[0])
    if not fastest[0] > 0:
        raise TrackerError("expected something that moves in both views, found nothing; choose other views")
    return FastMoment(fastest[1], fastest[2], "pictures")


_Moment = tuple[float, int, tuple[tuple[float, float], ...]]
"""Speed, frame, and place in each view."""


def _fastest(path_px: Array) -> _Moment | None:
    """Return the fastest moment of points in views, (F, V, N, 2), undistorted px; None if no point moves."""
    before, here, after = path_px[:-2], path_px[1:-1], path_px[2:]
    speed, change = (np.linalg.norm(d, axis=-1) for d in (after - before, after - 2 * here + before))
    slower = np.nan_to_num((speed - change).min(axis=1), nan=-np.inf)  # (F - 2, N)
    if not slower.size or not slower.max() > 0:
        return None
    k, point = np.unravel_index(int(slower.argmax()), slower.shape)
    return float(slower[k, point]), int(k) + 1, _places(here[k, :, point])


def _places(points_px: Array) -> tuple[tuple[float, float], ...]:
    return tuple((float(u), float(v)) for u, v in points_px)


def _joint_paths(session: Session, cameras: Sequence[Camera]) -> Iterator[Array]:
    for person in session.people:
        stored = read_stored_poses(session.annotations_path, person.name, person.model)
        n_points = max((len(p.body.model.point_names) for p in stored.values()), default=0)
        path = np.full((session.n_frames, len(cameras), n_points, 2), np.nan)
        for k, pose in stored.items():
            points_world = pose.body.points_world
            for view, camera in enumerate(cameras):
                px = camera.pinhole.project(points_world)
                is_inside = ((px >= 0) & (px < camera.pinhole.size)).all(axis=-1, keepdims=True)
                path[k, view, : len(px)] = np.where(is_inside, px, np.nan)
        yield path


def _keypoint_paths(session: Session, views: Sequence[int]) -> Iterator[Array]:
    for name in list_observations(session):
        points = load_observations(session, name).points
        if points is not None:
            n_frames = len(points.points_px)
            seen = np.where(points.is_known[..., None], points.points_px, np.nan)[:, list(views)]
            seen = seen.reshape(n_frames, len(views), -1, 2)
            cameras = [session.cameras[i].camera for i in views]
            yield np.stack([c.undistort_points(seen[:, i]) for i, c in enumerate(cameras)], axis=1)


def _picture_changes(
    recording: Recording, cameras: Sequence[Camera], views: Sequence[int], report: Report
) -> Iterator[_Moment]:
    """Yield how much the pictures of some frames differ from the next ones in a tile, gray levels, and its middle."""
    frames = [k for k in recording.quick_frames(N_FRAMES) if k + 1 < recording.n_frames]
    for n, k in enumerate(frames):
        report("comparing pictures", n / len(frames))
        changes, centers = [], []
        for camera, *pair in zip(cameras, recording.read(k, views), recording.read(k + 1, views), strict=True):
            if any(image is None for image in pair):
                break
            now, after = (np.asarray(image, dtype=np.float64) for image in pair)
            change = tiles(np.abs(after - now))
            row, column = np.unravel_index(int(change.argmax()), change.shape)
            at = (np.array([column, row]) + 0.5) * camera.size / change.shape
            changes.append(float(change.max()))
            centers.append(camera.undistort_points(at))
        if len(changes) == len(views):
            yield min(changes), k, _places(np.array(centers))
