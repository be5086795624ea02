"""The overlay video, read by PyAV."""

import av
import numpy as np
import pytest
from stored_motions import distorted_cameras, random_poses

from app.export import overlay_video
from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.interchange.exports.motion import ExportedMotion, ExportOptions, PersonMotion, StoredPose
from tracker.session.session import load_session
from tracker.session.store.records import PoseRecord


def posed_motion(session, frames, gaps=()):
    """The person of a session in a random pose, which no store has."""
    (person,) = session.people
    values = random_poses(person.model, 3, 4)[1]
    record = PoseRecord(values, ("manual",) * len(values), 1)
    poses = {f: StoredPose(PosedBody(person.model, values), record) for f in frames if f not in gaps}
    return ExportedMotion(session, frames, (PersonMotion(0, person, poses),), (0,), 0)


def frames_of(path):
    with av.open(str(path)) as file:
        (stream,) = file.streams.video
        return stream.average_rate, [f.to_ndarray(format="rgb24").astype(int) for f in file.decode(stream)]


def painted(image):
    """Pixels of the colour #53a504 of the person, (H, W)."""
    return np.abs(image - (0x53, 0xA5, 0x04)).max(axis=-1) < 60


@pytest.mark.slow
def test_one_view_has_the_footage_with_the_body_over_it(session, tmp_path):
    loaded = load_session(session)
    motion = posed_motion(loaded, range(2, 5), gaps=(3,))
    ticks = []
    overlay_video.write_overlay_video(motion, ExportOptions(view="FRONT"), tmp_path / "a.mp4", lambda: ticks.append(1))
    rate, images = frames_of(tmp_path / "a.mp4")
    with av.open(str(tmp_path / "a.mp4")) as file:
        assert file.metadata["comment"] == "calibration revision 1 of the session"
    assert len(images) == len(ticks) == 3
    assert rate == loaded.fps
    camera = next(c.camera for c in loaded.cameras if c.camera.name == "FRONT")
    assert images[0].shape == (camera.height, camera.width, 3)
    drawn = painted(images[0]) & ~painted(images[1])  # frame 3 has no body
    assert np.count_nonzero(drawn) > 300
    points_px = camera.project(motion.people[0].poses[2].body.points_world)
    rows, columns = np.nonzero(drawn)
    assert abs(np.median(columns) - np.median(points_px[:, 0])) < 30
    assert abs(np.median(rows) - np.median(points_px[:, 1])) < 60


@pytest.mark.slow
def test_a_grid_shows_all_views(session, tmp_path):
    motion = posed_motion(load_session(session), range(2, 3))
    overlay_video.write_overlay_video(motion, ExportOptions(), tmp_path / "a.mp4")
    _, (image,) = frames_of(tmp_path / "a.mp4")
    width, height = motion.session.cameras[0].camera.size
    assert image.shape == (2 * height, 2 * width, 3)
    for row in (0, 1):
        for column in (0, 1):
            tile = image[row * height : (row + 1) * height, column * width : (column + 1) * width]
            assert np.count_nonzero(painted(tile)) > 150


@pytest.mark.parametrize(
    ("n", "size", "grid", "tile"),
    [
        (4, (640, 480), (2, 2), (640, 480)),
        (4, (1080, 1920), (4, 1), (480, 852)),  # two rows would halve the views
        (5, (1920, 1080), (3, 2), (640, 360)),
        (1, (801, 601), (1, 1), (801, 601)),
    ],
)
def test_the_views_of_a_grid_are_as_large_as_can_be(n, size, grid, tile):
    sizes = [size] * n
    assert overlay_video._grid(sizes) == grid
    assert overlay_video._tile_size(sizes) == tile


def test_contours_are_drawn_where_the_lens_shows_them():
    camera = distorted_cameras()[0]
    ends = np.array([[600, 400, 604, 400], [2000, 240, 2004, 240]], np.float32)
    (filmed,) = overlay_video._as_filmed(camera, ends)  # the second is far outside
    np.testing.assert_allclose(camera.undistort_points(filmed), ends[0].reshape(2, 2), atol=0.05)
    assert np.abs(filmed - ends[0].reshape(2, 2)).max() > 5


def test_nothing_is_left_of_a_video_that_was_stopped(session, tmp_path):
    from tracker.interchange.exports.export_files import export
    from tracker.interchange.exports.formats import FORMATS

    def stop():
        raise KeyboardInterrupt

    motion = posed_motion(load_session(session), range(2, 5))
    with pytest.raises(KeyboardInterrupt):
        export(FORMATS["mp4"], motion, ExportOptions(view="FRONT"), tmp_path / "out.mp4", tick=stop)
    assert [p.name for p in tmp_path.iterdir()] == [session.name]
    (tmp_path / "out.mp4").mkdir()
    with pytest.raises(TrackerError, match="found a folder"):
        export(FORMATS["mp4"], motion, ExportOptions(), tmp_path / "out.mp4", overwrite=True)


def test_a_character_moves_beside_the_footage(session, tmp_path):
    """Each view has twice its width: the footage with the person, and the character as the same camera sees it."""
    motion = posed_motion(load_session(session), range(2, 4), gaps=(3,))
    options = ExportOptions(view="FRONT", character="gavrila22_cones:1.2")
    overlay_video.write_overlay_video(motion, options, tmp_path / "a.mp4")
    _, images = frames_of(tmp_path / "a.mp4")
    camera = next(c.camera for c in motion.session.cameras if c.camera.name == "FRONT")
    assert images[0].shape == (camera.height, 2 * camera.width, 3)
    character = np.abs(images[0][:, camera.width :] - images[1][:, camera.width :]).max(axis=-1) > 60
    assert np.count_nonzero(character) > 2000  # frame 3 has no pose
    body = motion.people[0].poses[2].body
    assert np.ptp(np.nonzero(character)[0]) < 0.9 * np.ptp(camera.project(body.points_world)[:, 1])
