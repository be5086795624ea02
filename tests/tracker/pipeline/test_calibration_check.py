"""The sentences of a check on what its frames cannot show, and on two cameras."""

from types import SimpleNamespace

import numpy as np
import pytest
from rig_scenes import CAMERAS, FPS, NAMES, nothing_seen, turned, viewed

from tracker.body.model import PosedBody
from tracker.body.motion.pose_path import PosePath
from tracker.errors import TrackerError
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.evaluation.references import read_joints
from tracker.evidence.observer import open_observer
from tracker.footage.camera_source import LostFrames
from tracker.geometry.camera_correction import N_CORRECTIONS, TIME
from tracker.pipeline.calibration_check import check_calibration, contradiction
from tracker.pipeline.posed_recording import PosedRecording
from tracker.session.assemble import NewSession, assemble


class Seen:
    """A recording all of whose frames are seen."""

    fps, middle_s = FPS, 0.0

    def __init__(self, frames, names=NAMES):
        self.camera_names, self._frames = names[: len(frames[0].views)], frames

    def credible_frames(self, within=None):
        return list(range(len(self._frames)))

    def diverse(self, frames, n):
        return list(frames)[:n]

    def seen(self, frames, report=None):
        return [self._frames[k] for k in frames]


def still(frames):
    return [f._replace(paths=tuple(PosePath.steady(np.zeros_like(p.step(0)), FPS) for p in f.paths)) for f in frames]


def test_people_who_move_before_healthy_cameras_need_no_sentence():
    check = check_calibration(Seen(viewed({}, range(3))))
    assert check.sentences == []


def test_poses_without_motion_tell_no_time():
    check = check_calibration(Seen(still(viewed({}, range(3)))))
    assert check.sentences == ["nobody moves enough on these frames to show whether the cameras are simultaneous"]
    assert check.named == ()


def test_a_person_who_stands_still_is_said_to():
    check = check_calibration(Seen(still(viewed({}, [1, 1, 1]))))
    assert any(s.startswith("people stand still on these frames") for s in check.sentences)
    assert check.named == ()


@pytest.mark.slow
def test_a_camera_that_sees_nothing_is_said_to():
    frames = [f._replace(views=(nothing_seen(f.views[0]), *f.views[1:])) for f in viewed({}, range(3))]
    check = check_calibration(Seen(frames))
    assert check.sentences == ["camera cam0 shows nobody on these frames"]
    assert check.named == ()


@pytest.mark.slow
def test_two_cameras_contradict_each_other_without_a_name():
    check = check_calibration(Seen(viewed({0: turned(pitch_deg=1.5)}, range(4), cameras=CAMERAS[:2])))
    (sentence,) = check.contradictions
    assert sentence.startswith("the two cameras contradict each other by")
    assert sentence.endswith("nothing shows which is off")
    assert check.named == ()
    assert not check.corrections.any()


@pytest.mark.parametrize(
    ("n", "words"), [(1, "lost 1 frame"), pytest.param(-2, "doubled 2 frames", marks=pytest.mark.slow)]
)
def test_a_clock_that_changes_within_the_recording_has_lost_whole_frames(n, words):
    late = np.zeros(N_CORRECTIONS)
    late[TIME] = n / FPS
    check = check_calibration(Seen([*viewed({}, range(5)), *viewed({1: late}, range(5, 10))]))
    assert (check.named, check.lost) == (("cam1",), {"cam1": LostFrames(5, n)})
    (sentence,) = check.sentences
    assert sentence.startswith(f"camera cam1 {words} before frame 5: ")
    assert check.corrections[1, TIME] == n / FPS
    np.testing.assert_array_equal(check.corrections_on(4), 0.0)
    np.testing.assert_array_equal(check.corrections_on(5), check.corrections)
    check.require_applicable([(SimpleNamespace(cost=2.0), SimpleNamespace(cost=1.0))])


@pytest.mark.slow
def test_a_camera_that_was_turned_within_the_recording_is_not_corrected():
    check = check_calibration(Seen([*viewed({}, range(5)), *viewed({1: turned(yaw_deg=1.0)}, range(5, 10))]))
    assert (check.since, check.lost) == ({"cam1": 5}, {})
    with pytest.raises(TrackerError, match="found that cam1 moved before frame 5; make a session of the frames from 5"):
        check.require_applicable([(SimpleNamespace(cost=2.0), SimpleNamespace(cost=1.0))])
    few = check_calibration(Seen([*viewed({}, range(3)), *viewed({1: turned(yaw_deg=1.0)}, range(3, 13))]))
    assert (few.since, few.named) == ({}, ("cam1",))  # three frames are no proof that it stood right before


def test_a_correction_without_other_frames_is_refused():
    check = check_calibration(Seen(viewed({1: turned(yaw_deg=1.0)}, range(3))))
    assert check.named == ("cam1",)
    with pytest.raises(TrackerError, match="other frames with poses to confirm the correction, found none"):
        check.require_applicable([])


def test_other_frames_confirm_a_correction_by_their_summed_cost():
    """Frames that do not show it fit a little better or worse by chance."""
    check = check_calibration(Seen(viewed({}, range(3))))

    def scores(*falls_nats):
        return [(SimpleNamespace(cost=10.0), SimpleNamespace(cost=10.0 - fall)) for fall in falls_nats]

    check.require_applicable(scores(-0.1, -0.1, -0.2, 3.0))
    with pytest.raises(TrackerError, match=r"found 3 of 4, and together worse by 2\.6 nats; the calibration stays"):
        check.require_applicable(scores(0.1, 0.1, 0.2, -3.0))


@pytest.mark.slow
def test_a_glance_says_nothing_of_few_frames():
    frames = viewed({1: turned(yaw_deg=1.0)}, [0, 1, 2])
    assert contradiction(Seen(frames)) == ""
    found = contradiction(Seen(frames * 7))
    assert found.startswith("camera cam1 is ")
    assert found.endswith(" or the body has other sizes")  # a figure is for the check


@pytest.mark.slow
def test_no_camera_changes_where_a_body_of_a_preset_is_off_before_static_ones(data_folder, tmp_path):
    """Real footage: its cameras stood still, and the sizes of the body are those of nobody."""
    data = data_folder("balance_real")
    parts = {
        "calibration": data / "Calib.toml",
        "videos": sorted(data.glob("*.mp4")),
        "background": data / "background",
    }
    session = assemble(NewSession(tmp_path / "session", **parts))
    joints, model = read_joints(data / "reference_joints.trc", session.fps), session.people[0].model
    known = [dict(zip(joints.names, places, strict=True)) for places in joints.points]
    named = [{n: p for n, p in places.items() if n in model.point_names} for places in known]
    poses = {k: PosedBody(model, fit_to_points(model, own).pose) for k, own in enumerate(named)}
    with open_observer(session.cameras) as observer:
        check = check_calibration(PosedRecording(observer, session.fps, [poses]))
    assert (check.since, check.lost) == ({}, {})
