"""Cameras that are off are found, with a correction that mends them; healthy ones are left alone."""

import numpy as np
import pytest
from known_faults import fit_fault
from rig_scenes import FPS, NAMES, nothing_seen, person_of, turned, viewed

from tracker.body.motion.pose_path import PosePath
from tracker.calibration.check.diagnosis import SEEN_PX, Diagnosis, diagnose, findings, glance, misfit, sentence
from tracker.calibration.check.fault_search import Fault, FaultSearch, FoundFault, Step, as_tracked, prior_sigmas
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.formats.model_toml import load_model
from tracker.geometry.camera_correction import DRIFT, KINDS, N_CORRECTIONS, ROTATION, TIME, with_step


def check(frames):
    diagnosis = diagnose(frames, [SizeParameters(frames[0].bodies[0].model)], FPS)
    return diagnosis, findings(diagnosis, frames, NAMES)


def named(cameras):
    return [c.name for c in cameras if c.kinds]


def test_a_turned_camera_is_named_and_mended():
    off = turned(0.3, -0.5, 0.4)
    diagnosis, cameras = check(viewed({2: off}, range(3)))
    assert named(cameras) == ["cam2"]
    assert cameras[2].kinds == ("rotation",)
    # The scene was filmed by the camera that stands otherwise: the correction brings the calibration there.
    left = with_step(-off, diagnosis.corrections[2])[ROTATION]
    assert np.degrees(np.abs(left)).max() < 0.1
    assert cameras[2].misfit_px > 3
    assert "camera cam2 is turned" in sentence(cameras[2])


@pytest.mark.slow
def test_a_known_fault_is_fitted_however_small_it_is():
    off = turned(yaw_deg=0.02)
    frames = viewed({2: off}, range(3))
    sizes = [SizeParameters(frames[0].bodies[0].model)]
    assert not diagnose(frames, sizes, FPS).kept
    fitted = fit_fault(frames, sizes, FPS, Fault(2, "rotation"))
    assert [k.fault for k in fitted.kept] == [Fault(2, "rotation")]
    assert not np.delete(fitted.corrections, 2, axis=0).any()
    left, sigma = with_step(-off, fitted.corrections[2])[ROTATION], fitted.sigmas(2)[ROTATION]
    assert np.all(sigma > 0)
    assert np.all(np.abs(left) < 4 * sigma)


@pytest.mark.slow
def test_a_glance_names_a_turned_camera_and_no_healthy_one():
    for off, expected in (({2: turned(yaw_deg=0.8)}, ["cam2"]), ({}, [])):
        frames = viewed(off, range(3))
        found = glance(frames, [SizeParameters(frames[0].bodies[0].model)], FPS)
        assert named(findings(found, frames, NAMES)) == expected


@pytest.mark.slow
def test_a_clock_that_runs_at_another_rate_is_told_from_one_that_is_late():
    off = np.zeros(N_CORRECTIONS)
    off[TIME], off[DRIFT] = 0.01, 0.03
    diagnosis, cameras = check(viewed({1: off}, range(0, 60, 6)))
    assert cameras[1].kinds in (("time", "drift"), ("drift", "time"))
    found, sigma = diagnosis.corrections[1], diagnosis.sigmas(1)
    assert found[DRIFT] == pytest.approx(0.03, abs=0.003)
    assert np.abs(found - off)[[TIME, DRIFT]] == pytest.approx(0, abs=4 * sigma[[TIME, DRIFT]].max())
    assert "drifting in time" in sentence(cameras[1])
    late = np.zeros(N_CORRECTIONS)
    late[TIME] = 0.02
    _, cameras = check(viewed({1: late}, range(0, 60, 6)))
    assert cameras[1].kinds == ("time",)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["position", "focal", "time"])
def test_other_faults_are_named_by_their_kind(kind):
    off = np.zeros(N_CORRECTIONS)
    off[{"position": 3, "focal": 6, "time": TIME}[kind]] = {"position": 0.04, "focal": 0.05, "time": 0.02}[kind]
    _, cameras = check(viewed({1: off}))
    assert named(cameras) == ["cam1"]
    assert kind in (*cameras[1].kinds, *cameras[1].rivals)
    assert cameras[1].misfit_px == pytest.approx(misfit(viewed({}), 1, off)[0], rel=0.3)


def test_a_small_rest_of_time_is_named_of_a_corrected_clock_alone():
    frames, corrections = viewed({}, range(1)), np.zeros((4, N_CORRECTIONS))
    corrections[1, TIME] = 0.0005
    nothing = Step(np.zeros(N_CORRECTIONS), np.zeros(N_CORRECTIONS), 0.0)
    kept = (FoundFault(Fault(1, "time"), 30.0, {}),)
    steps = {h: nothing for i in range(4) for k in KINDS if (h := Fault(i, k)) != kept[0].fault}
    found = Diagnosis(corrections, np.zeros((corrections.size,) * 2), kept, steps, None)
    assert named(findings(found, frames, NAMES)) == []
    late = [f._replace(ahead_s=(0.0, 0.02, 0.0, 0.0)) for f in frames]
    assert named(findings(found, late, NAMES)) == ["cam1"]


@pytest.fixture
def settled():
    """Healthy cameras, of which camera 1 has a clock, by next to nothing: no fault promises anything."""
    frames = [f._replace(ahead_s=(0.0, 1e-9, 0.0, 0.0)) for f in viewed({}, range(3))]
    search = FaultSearch(frames, [SizeParameters(frames[0].bodies[0].model)], prior_sigmas(FPS))
    return search, search.fitted(as_tracked(frames, search._parameters), ())


def test_a_corrected_clock_is_tried_again_whatever_it_promises(settled, monkeypatch):
    search, fit = settled
    tried = list[Fault]()
    monkeypatch.setattr(search, "_raced", lambda fit, faults: (tried.extend(faults), {})[1])
    assert search.best(fit, (), ()) is None
    assert set(tried) == {Fault(1, "time"), Fault(1, "drift")}


@pytest.mark.parametrize(("size_s", "is_found"), [(1e-5, False), (0.1, True)])
def test_a_fault_must_be_worth_it_by_its_size_too(settled, monkeypatch, size_s, is_found):
    """Contours match other edges, so that the cost falls by 50 nats, by however little the clock is corrected."""
    search, fit = settled
    late = Fault(1, "time")
    found = search.refitted(fit, {late}, 0)
    found.state.corrections[1, TIME] = size_s
    found = found._replace(equations=found.equations._replace(cost=fit.cost - 50.0))
    monkeypatch.setattr(search, "_raced", lambda fit, faults: {late: found})
    best = search.best(fit, (), ())
    assert (best is not None and best[0].fault == late) is is_found


@pytest.mark.slow
def test_two_cameras_are_named():
    _, cameras = check(viewed({0: turned(yaw_deg=0.8), 1: turned(pitch_deg=-0.8)}, range(4)))
    assert set(named(cameras)) == {"cam0", "cam1"}


def test_healthy_cameras_are_left_alone():
    diagnosis, cameras = check(viewed({}, range(3)))
    assert named(cameras) == []
    assert diagnosis.kept == ()
    assert not diagnosis.corrections.any()
    assert all(c.misfit_px < SEEN_PX for c in cameras)


@pytest.mark.slow
def test_the_sizes_of_another_person_are_no_fault_of_a_camera():
    """A generic body in the place of a person of other lengths and girths."""
    model = load_model("gavrila34", 1.7)
    _, cameras = check(viewed({}, range(4), model, person_of(model)))
    assert named(cameras) == []


@pytest.mark.slow
def test_a_camera_that_sees_nobody_is_said_to():
    frames = [f._replace(views=(nothing_seen(f.views[0]), *f.views[1:])) for f in viewed({}, range(3))]
    _, cameras = check(frames)
    assert [c.is_seen for c in cameras] == [False, True, True, True]
    assert named(cameras) == []


@pytest.mark.slow
def test_a_body_that_stands_still_tells_no_time():
    frames = [
        f._replace(paths=(PosePath.steady(np.zeros_like(f.paths[0].step(0)), FPS),)) for f in viewed({}, range(3))
    ]
    _, cameras = check(frames)
    assert all(c.sigma[TIME] == pytest.approx(1 / FPS) for c in cameras)
