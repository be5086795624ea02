"""Imported observations in the page's program: listed, shown, judged, taken as poses, and imported from files."""

import threading
import time

import numpy as np
import pytest
from fake_detector import FakeDetector
from gestures import drag, wait_for
from mask_files import write_masks
from observed_people import BODY_25, seen, true_motion, write_openpose

from app.control.tracking import observing
from app.drawing import overlays
from app.state.page_view import View
from tracker.errors import TrackerError
from tracker.evaluation.judging.judge import Judgement, LimbVerdict
from tracker.interchange.observations.plans import ImportRequest
from tracker.pipeline import automatic_run
from tracker.pipeline.keypoint_evidence import read_points
from tracker.session.session import load_session

pytestmark = pytest.mark.usefixtures("film_once")
VIEW = View(frozenset(("imported",)), (1, 1, 1, 1))


@pytest.fixture
def request_of(controller, tmp_path):
    """Files of the person whom the cameras of the session show, and the request that imports them."""
    session = controller.session
    files = write_openpose(tmp_path / "found", session.camera_names, seen(session, [true_motion(session)]))
    return ImportRequest("openpose", (files,), tuple(p.name for p in session.people))


@pytest.fixture
def imported(controller, request_of):
    controller.observing.plan(request_of)
    controller.observing.store()
    return controller


def kinds(controller, kind):
    state = controller.state
    paths = overlays.paths(controller.session, state, VIEW, None)
    return {p.camera: p.segments_px for p in paths if p.kind == kind and len(p.segments_px)}


def at_rest(controller):
    wait_for(lambda: not controller.state.observations.running, 60)
    return controller.state.observations


@pytest.mark.slow
def test_files_are_previewed_and_then_stored(controller, request_of):
    wait_for(lambda: controller.state.observations.sets == ())
    controller.observing.plan(request_of)
    assert kinds(controller, "imported").keys() == {0, 1, 2, 3}
    assert not (controller.session.folder / "observations").exists()
    controller.observing.discard()
    assert kinds(controller, "imported") == {}
    with pytest.raises(TrackerError, match="check the files first"):
        controller.observing.store()
    controller.observing.plan(request_of)
    controller.observing.store()
    (found,) = controller.state.observations.sets
    assert (found.name, found.format, found.is_in_space) == ("openpose", "openpose", False)
    assert found.frames == controller.session.n_frames
    assert controller.state.observations.plan is None


@pytest.fixture
def detector(controller, monkeypatch):
    """A detector that knows the truth takes the place of the network, and of the footage."""
    fake = FakeDetector(seen(controller.session, [true_motion(controller.session)]))
    detect = observing.detect_people
    monkeypatch.setattr(observing, "load_detector", lambda *_: (fake, "fake own"))
    monkeypatch.setattr(observing, "detect_people", lambda session, _, *more: detect(session, fake, *more))
    return fake


@pytest.mark.slow
def test_detected_people_are_stored_and_shown(controller, detector):
    n = controller.session.n_frames
    for name in ("detected", "detected 2"):
        controller.observing.detect()
        outcome = at_rest(controller)
        assert (outcome.message.strip(), outcome.failed) == (f"Detected people on {n} frames.", False)
        assert outcome.shown.name == name
    assert [s.name for s in outcome.sets] == ["detected", "detected 2"]


@pytest.mark.slow
def test_a_detection_that_is_stopped_keeps_what_it_found_and_goes_on(controller, detector):
    stopped = threading.Event()

    def look(picture, square, look=detector.look):
        if len(detector.looks) == 40 and not stopped.is_set():
            stopped.set()
            controller.observing.stop()
        return look(picture, square)

    detector.look = look
    controller.observing.detect()
    outcome = at_rest(controller)
    assert outcome.message.startswith("Stopped; what was found is kept")
    (some,) = outcome.sets
    assert 0 < some.frames < controller.session.n_frames
    controller.observing.detect()
    (whole,) = at_rest(controller).sets
    assert (whole.name, whole.frames) == ("detected", controller.session.n_frames)


def test_detected_people_are_shown_while_the_user_watches(controller, detector, monkeypatch):
    monkeypatch.setattr(observing, "_SHOWN_EVERY_S", 0.0)
    frames, n_drawn = [], []

    def look(picture, square, look=detector.look):
        if controller.state.frame != (frames or [0])[-1]:
            frames.append(controller.state.frame)
            n_drawn.append(len(kinds(controller, "imported")))
        if len(frames) == 5:  # the user goes elsewhere, and stays there
            controller.navigation.seek(0)
        return look(picture, square)

    detector.look = look
    controller.observing.detect()
    assert not at_rest(controller).failed
    assert frames[:5] == [1, 2, 3, 4, 5]
    assert n_drawn[:5] == 5 * [4]
    assert controller.state.frame == 0


def test_people_are_detected_once_and_then_tracked(controller, detector, monkeypatch):
    begun = []
    monkeypatch.setattr(controller.observing._finding, "start", lambda **plan: begun.append(plan))
    for _ in range(2):
        controller.observing.detect(then_track=True)
        assert not at_rest(controller).failed
    assert begun == 2 * [{"of": "detected", "as_evidence": True}]
    assert [s.name for s in controller.state.observations.sets] == ["detected"]


def test_networks_that_are_missing_are_named_where_they_are_fetched(controller, monkeypatch, tmp_path):
    pytest.importorskip("ai_edge_litert")
    monkeypatch.setattr(observing, "default_folder", lambda: tmp_path)
    controller.observing.detect()
    outcome = at_rest(controller)
    assert outcome.failed
    assert "docs/observations.md" in outcome.message


def test_points_are_drawn_where_they_are_in_undistorted_pixels(imported):
    session, points = imported.session, imported.state.observations.shown.points
    wrist = BODY_25.points.index("LWrist")
    u, v = session.cameras[0].camera.undistort_points(points.points_px[0, 0, 0, wrist])
    crosses = kinds(imported, "imported")[0]
    middles = crosses.reshape(-1, 2, 2).mean(axis=1)
    assert np.linalg.norm(middles - [u, v], axis=1).min() < 0.01
    imported.observing.show("")
    assert kinds(imported, "imported") == {}


def test_a_set_that_cannot_be_read_is_listed_with_the_reason(imported):
    (imported.session.folder / "observations" / "openpose" / "observations.toml").write_text("nonsense")
    imported.observing._list()
    (found,) = imported.state.observations.sets
    assert found.problem
    with pytest.raises(TrackerError):
        imported.observing.show("openpose")


def covered(controller):
    """Share of the regions of evidence that silhouettes cover, at least, of all views."""
    evidence = controller.frames.evidence(controller.state.frame)
    return min(view.silhouette.inside.mean() for view in evidence)


@pytest.mark.slow
def test_masks_are_used_at_once_in_place_of_the_background(controller, tmp_path):
    session = controller.session
    assert 0.001 < covered(controller) < 0.2
    width, height = session.cameras[0].camera.size
    masks = np.zeros((session.n_frames, len(session.cameras), height, width), np.uint8)
    masks[..., height // 10 :, width // 10 :] = 1
    folder = write_masks(tmp_path / "m", session.camera_names, masks)
    controller.observing.plan(ImportRequest("net", (folder,), ()))
    corner = session.cameras[0].camera.undistort_points(np.array([[width // 10, height // 10]], np.float64))[0]
    outline = kinds(controller, "imported")[0].reshape(-1, 2)
    assert np.linalg.norm(outline - corner, axis=1).min() < 0.01
    (folder / "FRONT" / "FRONT_000000.png").rename(tmp_path / "moved.png")
    assert 0 not in kinds(controller, "imported")  # the file is not there now
    (tmp_path / "moved.png").rename(folder / "FRONT" / "FRONT_000000.png")
    controller.observing.store()
    assert kinds(controller, "imported") == {}
    assert controller.state.observations.message == "The cameras use the masks of net as silhouettes."
    assert controller.session.cameras[0].masks == session.folder / "observations" / "net" / "masks" / "FRONT"
    assert all(c.masks is not None for c in load_session(session.folder).cameras)
    assert covered(controller) > 0.6
    assert controller.session_state.saver._session is controller.session  # else it would write the old cameras


def judged(controller):
    """A judgement that calls the left arm off on frame 3."""
    points = read_points(controller.session, "openpose")[0]
    off, fine = LimbVerdict(0.98, 0.2, "left arm jumps", "left_wrist"), LimbVerdict(0.02, 0.01, "", "left_ankle")
    frames = {3: {"left arm": off, "left leg": fine}, 4: {"left arm": fine}}
    return Judgement(controller.session.people[0].name, frames, {}, {}, points, {})


def test_limbs_that_are_off_are_drawn_on_their_frames_alone(imported, monkeypatch):
    monkeypatch.setattr(observing, "judge", lambda *words: [judged(imported)])
    imported.observing.judge("openpose")
    assert at_rest(imported).judged == "openpose"
    assert kinds(imported, "imported_off") == {}
    imported.navigation.seek(3)
    lines = kinds(imported, "imported_off")
    assert lines.keys() == {0, 1, 2, 3}
    assert len(lines[0]) == 3 * 2 + 2  # three joints, two bones
    imported.observing.show("")
    assert kinds(imported, "imported_off") == {}


def test_a_judgement_can_be_stopped_and_is_the_only_work(imported, monkeypatch):
    begun = threading.Event()

    def judge(session, observer, name, settings, sink, report):
        begun.set()
        for _ in range(1000):
            sink.report("finding", 0.5)
            time.sleep(0.01)

    monkeypatch.setattr(observing, "judge", judge)
    imported.observing.judge("openpose")
    assert begun.wait(10)
    with pytest.raises(TrackerError, match="no other work"):
        imported.observing.take("openpose")
    imported.observing.stop()
    assert imported.state.observations.message == "Stopped; nothing was changed."
    assert imported.state.observations.judgements == ()


@pytest.mark.slow
def test_joints_are_taken_as_poses_in_one_entry_and_keyframes_stay(imported):
    drag(imported, "left_wrist", (6.0, -9.0))
    kept = imported.state.poses[0]
    imported.observing.take("openpose")
    outcome = at_rest(imported)
    assert not outcome.failed, outcome.message
    assert imported.state.undo == "poses of openpose"
    assert (imported.state.poses[0] == kept).all()
    imported.navigation.seek(5)
    assert imported.state.people[0].source == "imported"
    body = imported.models[0].named_points_world(imported.state.poses[0])
    points = read_points(imported.session, "openpose")[0].places(5)
    gaps = [np.linalg.norm(body[n] - p) for n, p in points.items() if n in body]
    assert np.median(gaps) < 0.15  # sizes are those of the session's person
    imported.history.undo()
    imported.navigation.seek(5)
    assert imported.state.people[0].source is None


@pytest.mark.slow
def test_people_without_a_pose_are_placed_in_the_same_entry(imported):
    imported.observing.take("openpose")
    outcome = at_rest(imported)
    assert not outcome.failed, outcome.message
    assert imported.state.undo == "poses of openpose"
    imported.history.undo()
    assert imported.state.undo is None


@pytest.mark.slow
@pytest.mark.parametrize("as_evidence", [True, False])
def test_people_are_found_and_tracked_with_key_points(imported, monkeypatch, as_evidence):
    runs = []

    def start(self, frame, people, edit, on_end, observer):
        runs.append((people, edit, observer))
        on_end(True)

    monkeypatch.setattr("app.control.tracking.tracking.Tracking.start_outward", start)
    monkeypatch.setattr(automatic_run, "_acquire", lambda people, *more: {})
    imported.observing.track("openpose", as_evidence)
    with pytest.raises(TrackerError, match="no other search for people"):
        imported.observing.track("openpose", as_evidence)
    wait_for(lambda: not imported.state.finding.running, 60)
    assert imported.state.finding.message == "Done."
    assert imported.state.undo == "find people"
    assert imported.state.observations.shown.name == "openpose"
    ((people, edit, observer),) = runs
    assert people == (0,)
    assert edit is not None  # of the same entry of the history
    assert (observer.keypoints is not None) == as_evidence
    imported.observing.track("openpose", as_evidence)  # from the pose that is there
    wait_for(lambda: not imported.state.finding.running, 60)
    assert len(runs) == 2
