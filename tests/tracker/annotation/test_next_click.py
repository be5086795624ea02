"""The next best click: which limb on which frame, in which views, and when nothing is left that pays."""

import time
from dataclasses import replace

import numpy as np
import pytest

from tracker.annotation.expected_error import TRUNK, expected_errors, mean_errors
from tracker.annotation.next_click import HandSettings, propose
from tracker.body.limbs import limb_display_name, limbs
from tracker.body.model import PosedBody
from tracker.errors import SessionError
from tracker.evaluation.metrics import LOST_M
from tracker.session.session import load_session
from tracker.session.store.records import PoseRecord
from tracker.session.store.stored_poses import StoredPose

N = 40
SURE_M, UNSURE_M = 0.006, 0.08
STRETCH = range(20, 29)
TO_THE_END = HandSettings(tolerance=0.0)


@pytest.fixture(scope="module")
def session(sample_folder):
    return load_session(sample_folder)


@pytest.fixture(scope="module")
def model(session):
    return session.people[0].model


def column(model, name):
    """Index of a limb by its name for display."""
    return [limb_display_name(x.name) for x in limbs(model)].index(name)


def recording(session, unsure=("right arm",), on=STRETCH, lost=0.0, n=N, keyframes=(0,)):
    """Poses by frame of somebody who stands still, with limbs that are unsure on some frames."""
    model = session.people[0].model
    pose, out = model.neutral(), {}
    at = [limbs(model)[column(model, name)].parts for name in unsure]
    for k in range(n):
        sigmas, odds = np.full(len(model.point_names), SURE_M), np.zeros(len(limbs(model)))
        if k in on:
            for name, parts in zip(unsure, at, strict=True):
                # most unsure in the middle
                sigmas[np.isin(model.point_parts, parts)] = UNSURE_M / (1 + 0.2 * abs(k - (on[0] + on[-1]) // 2))
                odds[column(model, name)] = lost
        errors = np.eye(3) * (sigmas**2)[:, None, None]
        record = PoseRecord(pose, ("tracked",) * len(pose), 1, k in keyframes, errors=errors, limbs_lost=tuple(odds))
        out[k] = StoredPose(PosedBody(model, pose), record)
    return out


def test_the_middle_of_a_stretch_on_which_a_limb_is_unsure_comes_first(session):
    proposals = propose(session, [recording(session)])
    (click,) = proposals.clicks
    assert (click.frame, click.limb, click.person) == (24, "right arm", 0)
    assert STRETCH[0] <= click.frames[0] < 24 < click.frames[1] <= STRETCH[-1]
    assert click.now_mm == pytest.approx(1000 * float(mean_errors(np.array(UNSURE_M**2), np.array(0.0))))
    assert click.after_mm < click.now_mm / 2
    names = [c.camera.name for c in session.cameras]
    assert len(set(click.views)) == 2
    assert set(click.views) <= {*names}
    first, last = click.frames
    assert click.reason.startswith(f"right arm, frames {first} to {last}, seen best in {click.views[0]}: ")
    assert 0 < click.gain_mm < proposals.error_mm - proposals.best_mm
    assert proposals.interval_mm[0] < proposals.error_mm < proposals.interval_mm[1]


def test_odds_of_a_lost_limb_count_as_the_error_of_a_lost_limb(session):
    early = recording(session, ("right arm",), range(5, 8), lost=0.1)
    late = recording(session, ("left leg",), range(30, 33), lost=0.9)
    both = {k: (early if k < 15 else late)[k] for k in range(N)}
    first = propose(session, [both]).clicks[0]
    assert (first.limb, first.lost) == ("left leg", 0.9)
    assert "90% chance that it is lost" in first.reason
    assert mean_errors(np.array([1e-6]), np.array([0.5]))[0] == pytest.approx(LOST_M / 2, rel=0.02)


def test_an_action_carries_no_further_than_the_next_keyframe(session):
    free = propose(session, [recording(session)], 1, TO_THE_END).clicks[0]
    walled = recording(session)
    for k in (23, 25):
        walled[k] = replace(walled[k], record=replace(walled[k].record, keyframe=True, errors=None))
    between = next(c for c in propose(session, [walled], 9, TO_THE_END).clicks if c.frame == 24)
    assert between.frames == (24, 24)
    assert between.gain_mm < free.gain_mm / 2


def test_proposals_in_a_row_never_repeat_and_gain_less_and_less(session):
    poses = recording(session, ("right arm", "left leg"), range(2, 38), lost=0.3)
    proposals = propose(session, [poses], 12)
    assert len(proposals.clicks) > 3
    assert len({(c.frame, c.limb) for c in proposals.clicks}) == len(proposals.clicks)
    assert sum(c.gain_mm for c in proposals.clicks) <= proposals.error_mm - proposals.best_mm + 1e-6


def test_nothing_pays_where_a_hand_is_no_better(session):
    proposals = propose(session, [recording(session, ())], 3)
    assert proposals.clicks == ()
    assert proposals.best_mm == pytest.approx(proposals.error_mm)
    clumsy = HandSettings(sigma_px=60.0)
    assert propose(session, [recording(session)], 3, clumsy).clicks == ()
    with pytest.raises(SessionError, match="expected poses to improve, found none"):
        propose(session, [{}])


def test_a_view_in_which_the_limb_is_hidden_is_not_proposed(session, model):
    """Another person stands close before the camera that would show it best."""
    poses = recording(session)
    plain = propose(session, [poses]).clicks[0]
    camera = next(c.camera for c in session.cameras if c.camera.name == plain.views[0])
    arm = poses[24].body.points_world[model.point_names.index("right_wrist")]
    before = np.array(model.neutral())
    before[:3] += 0.25 * (camera.center_world - arm)
    other = PosedBody(model, before)
    record = PoseRecord(before, ("tracked",) * len(before), 1)
    two = replace(session, people=(session.people[0], replace(session.people[0], name="other")))
    (hidden, *_) = propose(two, [poses, {k: StoredPose(other, record) for k in range(N)}], 1, TO_THE_END).clicks
    assert plain.views[0] not in hidden.views


def test_keyframes_are_as_good_as_a_hand_unless_they_are_contradicted(session, model):
    poses = recording(session, lost=0.9, keyframes=(0, 24))
    assert 24 not in {c.frame for c in propose(session, [poses], 9).clicks}
    assert propose(session, [poses], 1, None, [{24}]).clicks[0].frame == 24
    assert not expected_errors(model, poses).is_lost[24]


def test_persistence_is_that_of_the_recording(session, model):
    def persistence(on):
        return expected_errors(model, recording(session, on=on)).persistence

    assert persistence(STRETCH) > 0.8
    apart = expected_errors(model, recording(session))
    noise = np.random.default_rng(0).uniform(0.5, 2, apart.variances.shape)[..., None, None]
    assert replace(apart, covariances=SURE_M**2 * noise * np.eye(3)).persistence < 0.3
    assert expected_errors(model, recording(session, ())).persistence == 0


def test_units_are_limbs_and_the_trunk(session, model):
    errors = expected_errors(model, recording(session))
    assert {*errors.units} == {TRUNK, "left arm", "right arm", "left leg", "right leg"}
    of = dict(zip(errors.joints, (errors.units[u] for u in errors.unit_of), strict=True))
    assert [of[j] for j in ("left_shoulder", "right_hip", "left_elbow", "right_ankle")] == [
        TRUNK, TRUNK, "left arm", "right leg",
    ]  # fmt: skip


@pytest.mark.slow
def test_a_proposal_takes_time_in_proportion_to_the_frames(session):
    times = []
    for n in (75, 300):
        poses = recording(session, ("right arm",), range(n // 3, n // 2), lost=0.4, n=n)
        propose(session, [poses])  # loads
        start = time.process_time()
        propose(session, [poses])
        times.append(time.process_time() - start)
    assert times[1] < 8 * times[0]  # 16 if it grew by the square
