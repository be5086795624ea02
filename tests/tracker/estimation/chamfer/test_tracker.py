from dataclasses import replace

import numpy as np
import pytest
from staging import SUIT, Shown, at, cameras_around, dressed, filmed, own_evidence, posed, shaken, solid, view_evidence
from tracking_runs import track, with_reference

from tracker.body.model import PosedBody
from tracker.body.motion.pose_steps import PredictSettings
from tracker.estimation.chamfer.settings import TrackSettings, pose_cost, search_frame
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.estimation.search import chamfer_cost
from tracker.estimation.search.best_first import SearchSettings
from tracker.estimation.tracking.tracker import Subjects
from tracker.evaluation.metrics import evaluate_joints, joints_of_poses
from tracker.evaluation.references import read_joints
from tracker.evidence.contours import occluding_contours
from tracker.evidence.observer import Observer, open_observer
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.session.session import load_session

COARSE = TrackSettings(
    estimate="search", search=SearchSettings(passes=(1.0,)), predict=PredictSettings(order=0), recover=None
)
STEP = 0.05
"""What a ball moves from frame to frame: a step of the lattice, so that tracking it is exact, metres."""


@pytest.fixture(scope="module")
def balls():
    """Two balls that move apart by 5 cm a frame, five frames: their model, true values (5, 2, 6), evidence."""
    model = solid((0.1, 0.15, 0.2))
    values = np.zeros((5, 2, 6))
    values[:, 0, 1], values[:, 1, 1] = -0.4 - STEP * np.arange(5), 0.4 + STEP * np.arange(5)
    cameras = cameras_around()
    return model, values, [own_evidence([at(model, *v[:3]) for v in pair], cameras) for pair in values]


def run(balls, frames, start, **options):
    model, _, views = balls
    return list(track(Shown(views), [model, model], start, frames, COARSE, **options))


def test_two_people_are_followed(balls):
    _, values, _ = balls
    estimates = run(balls, range(5), values[0])
    assert [f.frame for f in estimates] == [0, 1, 2, 3, 4]
    for k, estimate in enumerate(estimates):
        np.testing.assert_allclose(estimate.poses, values[k], atol=1e-9)
        assert estimate.cost_px < 0.5
        assert estimate.cost_px == pytest.approx(np.mean(estimate.view_costs_px))
        assert estimate.evaluations > 10


def test_backwards(balls):
    _, values, _ = balls
    estimates = run(balls, [4, 3, 2], values[4])
    assert [f.frame for f in estimates] == [4, 3, 2]
    np.testing.assert_allclose(estimates[-1].poses, values[2], atol=1e-9)


def test_keyframes_are_taken_as_they_are_and_tracking_goes_on_from_them(balls):
    _, values, _ = balls
    # The keyframe is beside the evidence by less than a search could mend: it stays all the same. The first ball has
    # wandered out of reach of the search until the keyframe brings it back.
    keyframe = values[2, 0] + (0, 0, 0.013, 0.02, 0, 0)
    lost = values[0] + np.array([[0, -0.6, 0, 0, 0, 0], [0] * 6])
    estimates = run(balls, range(5), lost, keyframes={2: {0: keyframe}})
    assert np.linalg.norm(estimates[1].poses[0] - values[1, 0]) > 0.3
    np.testing.assert_array_equal(estimates[2].poses[0], keyframe)
    for k in (3, 4):
        np.testing.assert_allclose(estimates[k].poses[0] - values[k, 0], keyframe - values[2, 0], atol=0.051)
    for k in range(5):  # the other one is searched throughout
        np.testing.assert_allclose(estimates[k].poses[1], values[k, 1], atol=1e-9)


def test_a_frame_of_keyframes_alone_is_not_searched(balls):
    _, values, _ = balls
    (found,) = run(balls, [2], values[0], keyframes={2: dict(enumerate(values[2]))})
    np.testing.assert_array_equal(found.poses, values[2])
    assert found.evaluations == 0
    assert found.cost_px < 0.5


def test_whom_to_track(balls):
    _, values, _ = balls
    estimates = run(balls, range(1, 4), values[0], tracked=[1])
    for k, estimate in enumerate(estimates, start=1):
        np.testing.assert_array_equal(estimate.poses[0], values[0, 0])  # stands where it was
        np.testing.assert_allclose(estimate.poses[1], values[k, 1], atol=1e-9)


def test_frames_are_read_one_at_a_time(balls):
    model, values, views = balls
    observer = Shown(views)
    running = track(observer, [model, model], values[0], range(5), COARSE)
    next(running)
    assert observer.asked == [0]  # a run that stops here has read no more
    running.close()
    assert list(track(observer, [model, model], values[0], [], COARSE)) == []


def test_settings_reach_the_cost(balls):
    model, values, views = balls
    far = values[0] + (0, 0, 5.0, 0, 0, 0)
    bodies = [PosedBody(model, v) for v in values[0]]
    for theta in (7.0, 31.0):
        cost = pose_cost(views[0], [model, model], values[0], TrackSettings(theta_px=theta))
        assert cost(far).total_px == pytest.approx(theta)
    paper = pose_cost(views[0], [model, model], values[0], TrackSettings(outliers="paper"))
    assert (paper.outliers, paper.models) == ("paper", tuple(b.model for b in bodies))
    twice = TrackSettings(search=SearchSettings(passes=(1.0, 0.5)))
    steps = list(search_frame(views[0], Subjects.of([model, model]), values[0], twice))
    assert [s.stage.factor for s in steps if s.stage_done] == [1.0, 1.0, 0.5, 0.5]


def dancing(model, n, angle_deg=4.0, jump_at=None, jump_deg=70.0):
    """Poses in which all limbs move evenly, (n, n_values); at one frame an arm is suddenly elsewhere, and stays."""
    poses, step = [posed(model, 1)], np.zeros(model.n_dofs)
    step[:2] = 0.02, -0.015
    for i, name in enumerate(model.dof_names):
        if name.endswith((".elevation", ".extension")) and not name.startswith("torso"):
            step[i] = np.radians(angle_deg)
    arm = np.where(np.array(model.dof_names) == "left_shoulder.abduction", np.radians(jump_deg), 0.0)
    for k in range(1, n):
        poses.append(model.clip(model.retract(poses[-1], step + (arm if k == jump_at else 0))))
    return np.array(poses)


def off_m(model, values, truth):
    return np.linalg.norm(model.points_world(values) - model.points_world(truth), axis=1)


@pytest.mark.slow
def test_refinement_follows_by_itself(gavrila):
    """Nobody is lost, so nothing is searched; the estimates say all there is to know."""
    truth = dancing(gavrila, 5)
    views = [dressed([PosedBody(gavrila, v)], cameras_around(), SUIT) for v in truth]
    found = list(track(Shown(views), [gavrila], truth[:1], range(5), TrackSettings()))
    for estimate, values in zip(found, truth, strict=True):
        assert off_m(gavrila, estimate.poses[0], values).max() < 0.01
        assert (estimate.statuses, estimate.notes, estimate.evaluations) == (("good",), ("",), 0)
        (part_costs_px,), (covariance,), (quality,) = estimate.part_costs_px, estimate.covariances, estimate.qualities
        assert part_costs_px.shape == (10,)
        assert np.nanmax(part_costs_px) < 1
        assert quality.views == 3
        # The pose is known to a degree or three and to a centimetre, less where an arm spins about itself.
        sigma = np.sqrt(np.diag(covariance))
        assert np.linalg.eigvalsh(covariance).min() > 0
        assert sigma[gavrila.dof_is_length].max() < 0.01
        assert np.median(sigma[~gavrila.dof_is_length]) < np.radians(3)


@pytest.mark.slow
def test_an_arm_that_jumps_is_searched_and_the_frame_says_so(gavrila):
    truth = dancing(gavrila, 5, jump_at=3)
    views = [dressed([PosedBody(gavrila, v)], cameras_around(4), SUIT) for v in truth]
    found = list(track(Shown(views), [gavrila], truth[:1], range(5), TrackSettings()))
    assert [f.notes[0] for f in found[:3]] == ["", "", ""]
    assert "left arm relocated" in found[3].notes[0]
    for estimate, values in zip(found, truth, strict=True):
        assert off_m(gavrila, estimate.poses[0], values).max() < 0.03
    # Left alone it is not found, and not called good.
    alone = list(track(Shown(views), [gavrila], truth[:1], range(5), TrackSettings(recover=None)))
    assert off_m(gavrila, alone[3].poses[0], truth[3]).max() > 0.1
    assert alone[3].statuses[0] != "good"
    assert alone[3].notes == ("left arm uncertain",)


def test_two_people_who_might_as_well_be_each_other_are_in_doubt():
    """Two alike within reach of each other's prediction: both poses are kept, and nobody is called good."""
    rod = solid((0.03, 0.03, 0.3))
    values = np.zeros((2, 6))
    values[:, 1] = -0.035, 0.035
    cameras = cameras_around(4)
    settings = TrackSettings(predict=PredictSettings(order=0), recover=None)
    (found,) = track(Shown([own_evidence([at(rod, *v[:3]) for v in values], cameras)]), [rod, rod], values,
                             [0], settings)  # fmt: skip
    np.testing.assert_allclose([p[:3] for p in found.poses], values[:, :3], atol=0.01)
    assert "lost" in found.statuses or set(found.statuses) == {"doubtful"}
    assert [r.split(", ")[-1] for r in found.notes] == [
        "may be swapped with person 2", "may be swapped with person 1",
    ]  # fmt: skip
    for person in (0, 1):
        (other,) = found.alternatives[person]
        np.testing.assert_allclose(other.values[:3], values[1 - person, :3], atol=0.01)
        assert other.cost_px == pytest.approx(found.cost_px, abs=0.2)
    # Where each was expected half a metre from the other nobody asks.
    values[:, 1] = -0.25, 0.25
    (found,) = track(Shown([own_evidence([at(rod, *v[:3]) for v in values], cameras)]), [rod, rod], values,
                             [0], settings)  # fmt: skip
    assert found.alternatives == ((), ())


def test_locked_limbs_are_neither_refined_nor_searched(gavrila, monkeypatch):
    """The arm that jumps is locked: it stays to the last bit, is not searched, and everything else is followed."""
    truth = dancing(gavrila, 4, jump_at=2)
    views = [dressed([PosedBody(gavrila, v)], cameras_around(4), SUIT) for v in truth]
    searched = []
    monkeypatch.setattr(
        "tracker.estimation.by_frame.frame_estimator.search_limbs",
        lambda m, due, fit, *_: searched.extend(due) or [fit],
    )
    free = ~np.array([name.startswith(("left_shoulder", "left_elbow")) for name in gavrila.dof_names])
    start = truth[0].copy()
    outside = gavrila.dof_names.index("left_elbow.extension")
    start[gavrila.dof_value[outside]] = gavrila.limits[outside, 1] + 0.1  # as an import may bring it
    found = list(track(Shown(views), [gavrila], [start], range(4), TrackSettings(), active_dofs=[free]))
    still, moving = gavrila.dof_value[~free], gavrila.dof_value[free]
    for estimate in found:
        np.testing.assert_array_equal(estimate.poses[0][still], start[still])
    assert not np.array_equal(found[-1].poses[0][moving], start[moving])
    assert {limb.name for limb in searched}.isdisjoint({"left_forearm"})
    assert all(not np.any(limb.dofs & ~free) for limb in searched)


@pytest.mark.parametrize("estimate", ["search", "refine"])
def test_of_two_people_each_has_own_locks(balls, estimate):
    model, values, views = balls
    free = [np.array([True] + [False] * 5), np.ones(6, dtype=bool)]
    settings = replace(COARSE, estimate=estimate)
    found = list(track(Shown(views), [model, model], values[0], range(3), settings, active_dofs=free))
    for k, found_ in enumerate(found):
        np.testing.assert_array_equal(found_.poses[0][1:], values[0, 0, 1:])
        np.testing.assert_allclose(found_.poses[1][:3], values[k, 1, :3], atol=0.02)


def test_a_keyframe_moves_what_is_locked_from_there_on(balls):
    _, values, _ = balls
    keyframe = values[2, 0] + (0, 0, 0.2, 0, 0, 0)
    free = [np.array([True, True, False] + [False] * 3), np.ones(6, dtype=bool)]
    estimates = run(balls, range(5), values[0], keyframes={2: {0: keyframe}}, active_dofs=free)
    assert [f.poses[0][2] for f in estimates] == [0, 0, 0.2, 0.2, 0.2]


@pytest.mark.slow
def test_segments_refused_by_the_prediction_are_tried_again(gavrila):
    """The prediction accepts no edge of an arm that jumps: it is found among all edges."""
    truth = dancing(gavrila, 5, jump_at=3)
    found = list(
        track(filmed([[PosedBody(gavrila, v)] for v in truth]), [gavrila], truth[:1], range(5), TrackSettings())
    )
    assert found[3].notes == ("left arm relocated",)
    assert found[1].traces == ((),)
    entry = found[3].traces[0][0]
    assert (entry.kind, entry.limbs, entry.taken) == ("limbs", ("left_forearm",), True)
    assert entry.after_nats < entry.before_nats - 3
    for estimate, values in zip(found, truth, strict=True):
        assert off_m(gavrila, estimate.poses[0], values).max() < 0.02


def test_a_body_that_is_elsewhere_is_searched(gavrila):
    truth = dancing(gavrila, 3)
    truth[2, 1] += 0.6
    *_, last = track(filmed([[PosedBody(gavrila, v)] for v in truth]), [gavrila], truth[:1], range(3), TrackSettings())
    assert "body searched" in last.notes[0]
    entry = next(x for x in last.traces[0] if x.kind == "body")
    assert entry.taken == (entry.after_nats < entry.before_nats)
    assert last.evaluations > 100
    if off_m(gavrila, last.poses[0], truth[2]).max() > 0.1:  # so far it is beyond the reach of the search
        assert last.statuses[0] != "good"


def test_a_pose_that_is_given_is_certain(gavrila):
    truth = dancing(gavrila, 4)
    views = [dressed([PosedBody(gavrila, v)], cameras_around(), SUIT) for v in truth]
    keyframe = gavrila.retract(truth[2], np.full(gavrila.n_dofs, 0.02))
    found = list(track(Shown(views), [gavrila], truth[:1], range(4), TrackSettings(), keyframes={2: {0: keyframe}}))
    given = found[2]
    np.testing.assert_array_equal(given.poses[0], keyframe)
    assert (given.statuses, given.notes, given.qualities, given.evaluations) == (("good",), ("",), (None,), 0)
    assert not given.covariances[0].any()
    assert np.nanmax(given.part_costs_px[0]) > np.nanmax(
        found[1].part_costs_px[0]
    )  # judged by its contours all the same
    assert off_m(gavrila, found[3].poses[0], truth[3]).max() < 0.01


def test_the_prediction_stands_while_nothing_is_seen(gavrila):
    """Without edges in any view the prediction stands, and the covariance says how far it is trusted."""
    truth = dancing(gavrila, 4)
    cameras = cameras_around()
    views = [dressed([PosedBody(gavrila, v)], cameras, SUIT) for v in truth]
    views[3] = tuple(view_evidence(c, np.zeros((480, 640), dtype=bool)) for c in cameras)
    settings = TrackSettings(trust_rad=0.1, trust_m=0.03)
    *_, last = track(Shown(views), [gavrila], truth[:1], range(4), settings)
    assert last.statuses == ("lost",)
    assert np.isnan(last.view_costs_px).all()
    assert off_m(gavrila, last.poses[0], truth[3]).max() < 0.02
    sigma = np.where(gavrila.dof_is_length, 0.03, 0.1)
    assert (np.sqrt(np.diag(last.covariances[0])) > 0.9 * sigma).all()


def test_a_sample_frame_is_drawn_to_its_truth(real_frame, sample_folder):
    """From 4 degrees and 2 cm beside, in every degree of freedom, the search comes as near as another body can."""
    model, values, views = real_frame
    start = shaken(model, values, np.random.default_rng(1), np.radians(4), 0.02)
    *_, last = search_frame(views, Subjects.of([model]), [start], TrackSettings())
    joints = [model.point_names.index(n) for n in LIMB_JOINTS]

    def off(v):
        return np.linalg.norm((model.points_world(v) - model.points_world(values))[joints], axis=1).mean()

    assert off(last.best[0]) < 0.045
    assert off(last.best[0]) < off(start)
    assert last.best_px < pose_cost(views, [model], [start], TrackSettings())([start]).total_px


@pytest.mark.slow
@pytest.mark.parametrize("n_people", [1, 2])
def test_poses_do_not_depend_on_what_was_looked_at_ahead(sample_folder, monkeypatch, n_people):
    """One person of the sample, and two, as if there were another: each as they stand a frame before."""
    session, frames = load_session(sample_folder), range(25, 28)
    joints = read_joints(sample_folder / "truth.trc", session.fps)
    model, ahead = session.people[0].model, []
    start = fit_to_points(model, dict(zip(joints.names, joints.points[24], strict=True))).pose
    aside = model.neutral() * 0
    aside[0] = 0.8
    starts = [start, start + aside][:n_people]

    def run():
        with open_observer(session.cameras) as observer:
            tracked = track(observer, [model] * n_people, starts, frames, TrackSettings(recover=None))
            return [(*f.poses, f.cost_px) for f in tracked]

    prefetch = Observer.prefetch
    monkeypatch.setattr(Observer, "prefetch", lambda *a, **k: ahead.extend(a[2:3]) or prefetch(*a, **k))
    looked_ahead = run()
    assert any(ahead) == (n_people > 1)
    monkeypatch.setattr(Observer, "prefetch", lambda *_, **__: None)
    for found, late in zip(looked_ahead, run(), strict=True):
        for one, other in zip(found, late, strict=True):
            np.testing.assert_array_equal(one, other)


@pytest.mark.slow
def test_a_real_recording(data_folder, tmp_path):
    """Three frames of a cluttered room from the reference's pose, as `init --method joints` sets it."""
    joints, sides = "reference_joints.trc", ("background",)
    session, reference, start = with_reference(data_folder("balance_real"), tmp_path / "s", joints, sides)
    model = session.people[0].model
    with open_observer(session.cameras) as observer:
        found = list(track(observer, [model], [start], range(3), TrackSettings()))
    poses = {f.frame: f.poses[0] for f in found}
    errors = evaluate_joints(joints_of_poses(model, poses, session.fps), reference, range(3))
    assert errors.mpjpe_mm < 90
    assert (errors.frames, errors.missing_frames, errors.lost_frames) == (3, 0, 0)


@pytest.mark.slow
def test_an_arm_that_passes_a_picture_on_the_wall_does_not_stay_there(data_folder, tmp_path):
    """Without a background: an arm swings before a patterned picture and along a skirting board."""
    session, reference, start = with_reference(data_folder("walk"), tmp_path / "s", heights=1.75)
    model, frames = session.people[0].model, range(12)
    with open_observer(session.cameras) as observer:
        found = list(track(observer, [model], [start], frames, TrackSettings(), keyframes={0: {0: start}}))
    poses = {f.frame: f.poses[0] for f in found}
    errors = evaluate_joints(joints_of_poses(model, poses, session.fps), reference, frames)
    assert errors.mpjpe_mm < 42
    assert (errors.missing_frames, errors.lost_frames) == (0, 0)


@pytest.mark.slow
@pytest.mark.parametrize("segments", [True, False])
def test_contours_are_traced_once_per_pose(gavrila, monkeypatch, segments):
    """Those of the prediction and those of the result, in each view; the cost of the result traces nothing."""
    truth = dancing(gavrila, 3)
    views = [dressed([PosedBody(gavrila, v)], cameras_around(), SUIT) for v in truth]
    traced, scored = [], []
    trace, score = occluding_contours.trace_pieces, chamfer_cost.score_traced
    monkeypatch.setattr(occluding_contours, "trace_pieces", lambda *a: traced.append(a) or trace(*a))
    monkeypatch.setattr(chamfer_cost, "score_traced", lambda *a: scored.append(a) or score(*a))
    for estimate in track(Shown(views), [gavrila], truth[:1], range(3), TrackSettings(segments=segments)):
        assert estimate.statuses == ("good",)
        assert (len(traced), len(scored)) == (3 + 3, 1)
        assert len(scored[0][0].firsts) == 3 + 1  # it is given the contours of all views
        traced.clear()
        scored.clear()
