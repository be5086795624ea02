"""The estimate of all frames of a run, on a simulated recording whose poses are known."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from filmed_run import FilmedRun, estimated, moving
from staging import cameras_around, own_evidence, posed

from tracker.body.limbs import limbs
from tracker.body.model import PosedBody
from tracker.compute.progress import mapped, result_of
from tracker.estimation.fitting.contour_residuals import ContourResiduals
from tracker.estimation.runs.frame_hypotheses import FrameHypotheses, Proposal
from tracker.estimation.runs.path_search import PathSearch
from tracker.estimation.runs.run_estimate import estimate_run
from tracker.estimation.trajectory import solve
from tracker.evidence.keypoints import ViewKeypoints

pytestmark = pytest.mark.slow  # each reads images of all frames

N, WRONG = 8, 4
NEAR_M = 0.03
"""Error of a point that contours show."""


@pytest.fixture(scope="module")
def film(gavrila):
    return FilmedRun(gavrila, moving(gavrila, N))


@pytest.fixture
def arm(gavrila):
    return [x.name for x in limbs(gavrila)].index("left_forearm")


def astray(model, poses, *frames, name="left_forearm"):
    """Poses with a limb elsewhere on some frames."""
    dofs = next(x.dofs for x in limbs(model) if x.name == name)
    return np.array([
        model.clip(model.retract(pose, 0.9 * dofs)) if k in frames else pose for k, pose in enumerate(poses)
    ])  # fmt: skip


def test_a_wrong_arm_on_one_frame_is_put_right(film, gavrila, arm):
    steps = estimate_run(film.asked(astray(gavrila, film.true[0], WRONG)))
    shown = []
    found = result_of(mapped(steps, shown.append))[0]
    assert film.errors_m(found).max() < NEAR_M
    entry = found[WRONG].entry
    assert (entry.kind, entry.limbs, entry.taken) == ("path", ("left_forearm",), True)
    assert entry.after_nats < entry.before_nats - 10
    assert [k for k in found if found[k].entry] == [WRONG]
    assert max(pose.elsewhere.max() for pose in found.values()) < 0.01
    assert [step.done for step in shown] == sorted(step.done for step in shown)
    assert len({step.total for step in shown}) == 1
    assert shown[-1].done <= shown[-1].total
    assert all(pose.cost_px < 2.0 and len(pose.view_costs_px) == 3 for pose in found.values())


def test_a_proposal_of_one_frame_leads_the_others_there(film, gavrila, arm):
    """The arm is wrong on all frames. On one of them another source knows better."""
    first = astray(gavrila, film.true[0], *range(N))
    proposals = {(2, 0): [Proposal(film.true[0][2], "backward")]}
    assert film.errors_m(estimated(film.asked(first, proposals=proposals))).max() < NEAR_M


@pytest.mark.parametrize("n_cameras", [1, 2])
@pytest.mark.parametrize("n_frames", [1, 2, 3])
def test_few_frames_and_cameras(gavrila, n_frames, n_cameras):
    film = FilmedRun(gavrila, moving(gavrila, n_frames), n_cameras=n_cameras)
    estimate = estimated(film.asked(film.true[0]))
    assert sorted(estimate) == list(range(n_frames))
    for pose in estimate.values():
        np.testing.assert_array_equal(gavrila.clip(pose.pose), pose.pose)
        assert np.isfinite(pose.errors_m2).all()
        assert np.isfinite(pose.elsewhere).all()
        assert pose.is_shown.all()
    if n_cameras == 2:
        assert film.errors_m(estimate).max() < NEAR_M
        assert max(pose.elsewhere.max() for pose in estimate.values()) < 0.05


def test_keyframes_stay_and_are_compared_as_others_are(film, gavrila, arm):
    true = film.true[0]
    keyframes = {1: true[1], WRONG: astray(gavrila, true, WRONG)[WRONG]}
    estimate = estimated(film.asked(true, keyframes=keyframes))
    for k, pose in keyframes.items():
        assert estimate[k].pose.tobytes() == pose.tobytes()
    assert estimate[1].elsewhere.max() < 0.05
    assert estimate[WRONG].elsewhere[arm] > 0.9
    assert np.delete(estimate[WRONG].elsewhere, arm).max() < 0.05
    assert film.errors_m(estimate)[[0, 1, 2, 6, 7]].max() < NEAR_M


def test_poses_that_stay_are_assessed(film, gavrila, arm):
    first = astray(gavrila, film.true[0], WRONG)
    estimate = estimated(film.asked(first, stays=True))
    for k, pose in enumerate(first):
        assert estimate[k].pose.tobytes() == pose.tobytes()
        assert (estimate[k].elsewhere[arm] > 0.9) == (k == WRONG)
        assert estimate[k].entry is None
    sigmas = [np.sqrt(np.trace(estimate[k].errors_m2, axis1=1, axis2=2)) for k in range(N)]
    wrist = gavrila.point_names.index("left_wrist")
    assert sigmas[WRONG][wrist] == pytest.approx(film.errors_m(estimate)[WRONG], rel=0.2)
    assert max(s.max() for k, s in enumerate(sigmas) if k != WRONG) < NEAR_M
    assert estimate[WRONG].cost_px > estimate[WRONG - 1].cost_px


@pytest.mark.parametrize(("n_shown", "is_shown"), [(1, False), (2, True)])
def test_a_limb_is_shown_by_two_views_or_more(film, gavrila, arm, monkeypatch, n_shown, is_shown):
    views_of_limbs = FrameHypotheses.views_of_limbs

    def hidden(*at):
        shown = views_of_limbs(*at)
        shown[n_shown:, arm] = False
        return shown

    monkeypatch.setattr(FrameHypotheses, "views_of_limbs", hidden)
    estimate = estimated(film.asked(film.true[0], stays=True))
    for pose in estimate.values():
        assert pose.is_shown.tolist() == [is_shown or i != arm for i in range(len(limbs(gavrila)))]


def test_key_points_show_a_limb_too(gavrila):
    """Of one view, beside contours."""
    frame = FrameHypotheses.__new__(FrameHypotheses)
    body, cameras = PosedBody(gavrila, posed(gavrila, 1)), cameras_around()
    views = own_evidence([body], cameras)
    costs = ContourResiduals(views, [body]).part_costs(body.values)
    costs = costs._replace(length_px=np.zeros_like(costs.length_px))
    wrist = ViewKeypoints(
        np.array([gavrila.part_index["left_forearm"]]), np.zeros((1, 3)), np.zeros((1, 2)), np.ones(1)
    )
    frame.person, frame.model = 0, gavrila
    frame.evidence = SimpleNamespace(views=[replace(views[0], keypoints=(wrist,)), *views[1:]])
    shown = frame.views_of_limbs(body.values, costs)
    assert np.argwhere(shown).tolist() == [[0, [x.name for x in limbs(gavrila)].index("left_forearm")]]


def test_locked_degrees_of_freedom_stay_in_every_proposal(film, gavrila, monkeypatch):
    """Also beside a keyframe that has another value, which contours show to be the right one."""
    at = gavrila.dof_names.index("left_elbow.extension")
    value, active = gavrila.dof_value[at], np.arange(gavrila.n_dofs) != at
    first = film.true[0].copy()
    first[:WRONG, value] -= 0.6
    compared, scored = [], FrameHypotheses._scored
    monkeypatch.setattr(
        FrameHypotheses, "_scored",
        lambda self, poses, sources: (compared.extend((self, p) for p in poses), scored(self, poses, sources))[1],
    )  # fmt: skip
    estimate = estimated(film.asked(first, keyframes={WRONG: film.true[0][WRONG]}, active=active))
    assert [estimate[k].pose[value] for k in range(N)] == first[:, value].tolist()
    assert len(compared) > 3 * N
    for own, pose in compared:
        assert pose[value] == own.bodies[0].values[value]


def test_people_are_estimated_in_turn(gavrila, monkeypatch):
    """Hypotheses are scored again on the frame alone where the other person's arm has moved since, and a person is
    searched again if there is one."""
    among, again, searches = FrameHypotheses.among, [], []

    def spied(frame, bodies):
        out = among(frame, bodies)
        again.append((frame.person, out is not frame))
        return out

    def search(frames, times_s):
        searches.append(frames[0].person)
        return PathSearch(frames, times_s)

    monkeypatch.setattr(FrameHypotheses, "among", spied)
    monkeypatch.setattr("tracker.estimation.runs.run_estimate.PathSearch", search)
    true = moving(gavrila, 5)
    beside = true[::-1].copy()
    true[:, 1] -= 0.5
    beside[:, 1] += 0.4
    film = FilmedRun(gavrila, true, beside)
    steps = estimate_run(film.asked(astray(gavrila, true, 2), astray(gavrila, beside, 1, name="right_forearm")))
    found = result_of(steps)
    assert [film.errors_m(found[i], i).max() < NEAR_M for i in range(2)] == [True, True]
    assert [[k for k in found[i] if found[i][k].entry] for i in range(2)] == [[2], [1]]
    assert again == [(person, person == 0 and k == 1) for person in range(2) for k in range(5)]
    assert searches == [0, 1, 0]


def test_blocks_give_nearly_what_one_block_gives(gavrila, monkeypatch):
    film = FilmedRun(gavrila, moving(gavrila, 30))
    first = astray(gavrila, film.true[0], 3, 14, 15)
    whole = estimated(film.asked(first))
    for name, n in (("_BLOCK_FRAMES", 15), ("_OVERLAP_FRAMES", 5), ("FRAMES_AT_ONCE", 25)):
        monkeypatch.setattr(solve, name, n)
    assert len(solve.even_blocks(30)) == 2
    asked = []
    evidence = film.observer.evidence
    monkeypatch.setattr(
        film.observer, "evidence", lambda k, *args, **kw: (asked.extend([k] * bool(args)), evidence(k, *args, **kw))[1]
    )
    estimate = estimated(film.asked(first))
    assert sorted(estimate) == list(range(30))
    apart = [gavrila.points_world(estimate[k].pose) - gavrila.points_world(whole[k].pose) for k in estimate]
    assert 0 < np.linalg.norm(apart, axis=-1).max() < 0.01
    assert film.errors_m(estimate).max() < NEAR_M
    assert [k for k in estimate if estimate[k].entry] == [3, 14, 15]
    assert {asked.count(k) for k in range(20)} == {1}  # around poses: the second block shares those of the first
