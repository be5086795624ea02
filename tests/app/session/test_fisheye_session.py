"""A session of which one camera has a fisheye lens: tracked, drawn, pinned and exported as with a common lens."""

import json
import shutil

import numpy as np
import pytest
from command_line import SAMPLE, output_of
from fisheye import refilm_session
from gestures import FRONT, PAGE, drag, pixel_of

from app.drawing import overlays
from app.export.overlay_video import write_overlay_video
from app.messages import encoding
from app.state.page_view import View
from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.evidence.camera_exchange import find_exchange
from tracker.evidence.observer import open_observer
from tracker.footage.recording import Recording
from tracker.footage.video import open_footage
from tracker.interchange.exports.motion import ExportedMotion, ExportOptions, PersonMotion, StoredPose
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseRecord


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return refilm_session(SAMPLE, tmp_path_factory.mktemp("fisheye") / "session", {"FRONT": 67.0})


@pytest.fixture
def session(made, tmp_path):
    return shutil.copytree(made, tmp_path / "session")


@pytest.fixture(scope="module")
def observer(made):
    loaded = load_session(made)
    with open_observer(loaded.cameras) as observer:
        yield observer


@pytest.mark.slow
def test_the_session_keeps_its_lens(session):
    cameras = [c.camera for c in load_session(session).cameras]
    assert [c.fisheye for c in cameras] == [True, False, False, False]
    assert cameras[0].pinhole.width > cameras[0].width == 640


@pytest.mark.slow
def test_the_page_gets_the_undistorted_picture_and_its_size(controller):
    camera = controller.session.cameras[FRONT].camera
    info = encoding.session(controller.session).cameras[FRONT]
    assert (info.width, info.height) == camera.pinhole.size
    assert controller.frames.images(0)[FRONT].shape == (info.height, info.width, 3)
    (path, *_) = [
        p
        for p in overlays.paths(controller.session, controller.state, View(frozenset({"contours"}), (1.0,) * 4), None)
        if p.camera == FRONT and p.kind == "model"
    ]
    points = camera.pinhole.project(PosedBody(controller.models[0], controller.state.poses[0]).points_world)
    assert np.all(path.segments_px.reshape(-1, 2).min(axis=0) <= points.max(axis=0))
    assert np.all(path.segments_px.reshape(-1, 2).max(axis=0) >= points.min(axis=0))


@pytest.mark.slow
def test_pins_are_stored_in_pixels_of_the_footage(opened, session):
    controller = opened()
    camera = controller.session.cameras[FRONT].camera
    place = pixel_of(controller, "left_wrist")
    controller.pinning.begin(PAGE, 0, FRONT, 0, "left_wrist", tuple(place), False)
    controller.pinning.end(PAGE)
    model = controller.models[0]
    wrist = PosedBody(model, controller.state.poses[0]).points_world[model.point_names.index("left_wrist")]
    store = AnnotationStore(session / "annotations.sqlite", read_only=True)
    (stored,) = store.pins("person", 0)
    store.close()
    np.testing.assert_allclose(stored.position_px, camera.project(wrist), atol=1e-6)
    (pin,) = opened().state.pins[0]
    np.testing.assert_allclose(pin.position_px, place, atol=1e-6)


@pytest.mark.slow
def test_no_pin_is_set_or_dragged_where_the_picture_is_black(controller):
    width, height = controller.session.cameras[FRONT].camera.pinhole.size
    black, shown = (width / 2, 1.0), (width / 2, height / 2)
    with pytest.raises(TrackerError, match="set it where the image shows the joint"):
        controller.pinning.begin(PAGE, 0, FRONT, 0, "head", black, False)
    controller.pinning.begin(PAGE, 0, FRONT, 0, "head", shown, False)
    controller.pinning.move(PAGE, black)
    controller.pinning.end(PAGE)
    assert controller.state.pins[0][0].position_px == shown


@pytest.mark.slow
def test_a_dragged_joint_goes_where_the_pointer_is(controller):
    start = pixel_of(controller, "left_wrist")
    drag(controller, "left_wrist", (12.0, -9.0))
    np.testing.assert_allclose(pixel_of(controller, "left_wrist"), np.add(start, (12.0, -9.0)), atol=2.0)


@pytest.mark.slow
def test_exported_video_is_drawn_on_the_footage_as_filmed(session, tmp_path):
    loaded = load_session(session)
    (person,) = loaded.people
    values = person.model.neutral()
    values[2] = 0.95
    record = PoseRecord(values, ("manual",) * len(values), 1)
    poses = {2: StoredPose(PosedBody(person.model, values), record)}
    motion = ExportedMotion(loaded, range(2, 4), (PersonMotion(0, person, poses),), (0,), 0)
    options = ExportOptions(view="FRONT", character="gavrila22")
    write_overlay_video(motion, options, tmp_path / "a.mp4")
    frames = open_footage(tmp_path / "a.mp4", "a")
    posed, empty = (frames.read(i).astype(int) for i in range(2))
    assert posed.shape == (480, 1280, 3)  # the footage, and the character beside it through the same lens
    filmed = loaded.cameras[0].camera.project(poses[2].body.points_world)
    for half in (slice(0, 640), slice(640, 1280)):
        changed = np.abs(posed[:, half] - empty[:, half]).max(axis=-1) > 60
        changed[:60] = False  # the number of the frame
        rows, columns = np.nonzero(changed)
        np.testing.assert_allclose(np.median([columns, rows], axis=1), np.median(filmed, axis=0), atol=40)
        assert np.ptp(rows) == pytest.approx(np.ptp(filmed[:, 1]), rel=0.35)


@pytest.mark.slow
def test_exchanged_footage_of_a_fisheye_is_named(session):
    loaded = load_session(session)
    with Recording(loaded.cameras) as recording:
        frames = {k: recording.read(k) for k in (0, 16, 32, 49)}

    class Frames:
        n_frames = 50

        def __init__(self, order):
            self.order = order

        def quick_frames(self, n):
            return np.linspace(0, self.n_frames - 1, n).astype(int).tolist()

        def read(self, k):
            nearest = min(frames, key=lambda known: abs(known - k))
            return [frames[nearest][i] for i in self.order]

    assert find_exchange(loaded.cameras, Frames((0, 1, 2, 3))) is None
    exchange = find_exchange(loaded.cameras, Frames((3, 1, 2, 0)))
    assert exchange is not None
    assert set(exchange.cameras) == {"FRONT", "LEFT"}


@pytest.mark.slow
def test_it_is_tracked_as_well_as_with_a_common_lens(session, run, tmp_path):
    twin, errors = shutil.copytree(SAMPLE, tmp_path / "twin"), []
    for folder in (twin, session):
        assert run("init", folder, "--method", "joints", "--joints", folder / "truth.trc", "--frame", "0")[0] == 0
        assert run("track", folder, "--frames", "0:12")[0] == 0
        out = output_of(run("evaluate", folder, "--reference", folder / "truth.trc", "--frames", "0:12", "--json"))
        errors.append(json.loads(out))
    common, fisheye = errors
    assert fisheye["lost_frames"] == common["lost_frames"] == 0
    assert fisheye["mpjpe_mm"] < common["mpjpe_mm"] + 3.0
