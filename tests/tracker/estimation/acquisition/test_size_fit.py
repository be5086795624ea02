"""Sizes from contours: a body of other proportions is found again, and what is not seen stays."""

from dataclasses import replace

import numpy as np
import pytest
from staging import cameras_around, own_evidence, posed, shaken

from tracker.body.dimensions import STATED_HEIGHT_SIGMA, PartDimensions, dimensions_of, stature_m, with_dimensions
from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.estimation.acquisition.from_contours import AcquisitionSettings, acquire_from_contours, choose_frames
from tracker.estimation.acquisition.size_fit import Round, SightedPerson, SizeFitSettings, fit_sizes_to_contours
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.estimation.acquisition.size_report import (
    acquired_segments,
    joint_swings,
    size_changes,
    unobservable_joints,
)
from tracker.estimation.fitting.gauss_newton import OTHER_BODY_M, PointTargets
from tracker.estimation.fitting.retarget import retarget_pose
from tracker.estimation.tracking.pose_errors import acquired_sigma_m
from tracker.formats.model_toml import load_model

CAMERAS = cameras_around(4)


def other_body(name="gavrila22", seed=3, share=1.0):
    """A person whose sizes differ from the preset's as people differ."""
    parameters = SizeParameters(load_model(name, 1.7))
    sizes = share * np.random.default_rng(seed).normal(size=len(parameters.names)) * parameters.sigmas
    sizes[parameters.of_kinds("taper", "exponent")] = 0.0
    return parameters.body(sizes)


def sighted(person, model, seeds, off_rad=0.05, off_m=0.02, placed=False):
    """Frames on which a person is seen, and the preset stands nearly in their place."""
    out = []
    for seed in seeds:
        pose = posed(person, seed)
        views = own_evidence([PosedBody(person, pose)], CAMERAS)
        start = shaken(model, pose, np.random.default_rng(seed), off_rad, off_m)
        points = np.arange(len(model.point_names))
        targets = PointTargets(points, person.points_world(pose), np.full(len(points), 1 / 0.01)) if placed else None
        out.append(SightedPerson(seed, views, (PosedBody(model, start),), 0, targets))
    return out


def thicknesses(body):
    sizes = dimensions_of(body).parts
    return np.array([sizes[p].girths_m for p in ("left_upper_arm", "left_thigh", "left_calf", "head")])


def lengths(body):
    sizes = dimensions_of(body).parts
    return np.array([sizes[p].length_m for p in ("left_upper_arm", "left_thigh", "left_forearm", "left_calf")])


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 4])
def test_lengths_and_girths_of_another_body_are_found(seed, model):
    person = other_body(seed=seed)
    parameters = SizeParameters(model)
    frames = sighted(person, model, range(5), placed=True)
    fit = fit_sizes_to_contours(parameters, frames, SizeFitSettings())
    for measure in (thicknesses, lengths):
        was, now = (np.abs(measure(b) / measure(person) - 1).mean() for b in (model, fit.body))
        assert now < 0.05 < was
    off = [
        np.linalg.norm(fit.body.points_world(p) - f.placed.targets_world, axis=1).mean()
        for p, f in zip(fit.poses, frames, strict=True)
    ]
    assert np.mean(off) < 0.012


def test_a_stated_height_is_kept_against_contours_of_another():
    """Somebody seems 4% taller than stated, as by the scale of the cameras. How sure the height is stays, too."""
    person, found = load_model("gavrila22", 1.768), {}
    quick = SizeFitSettings(rounds=(Round(("height", "build", "length"), 1.5, 4),))
    for sigma in (None, STATED_HEIGHT_SIGMA):
        model = replace(load_model("gavrila22", 1.7), height_sigma=sigma)
        parameters = SizeParameters(model)
        found[sigma] = fit_sizes_to_contours(parameters, sighted(person, model, range(2)), quick)
        assert found[sigma].body.height_sigma == sigma
    kept, other = found[STATED_HEIGHT_SIGMA], found[None].body.height_m
    assert abs(kept.body.height_m - 1.7) < 0.002 < 0.02 < other - 1.7
    by_sizes = parameters.prior[-1] * STATED_HEIGHT_SIGMA**2
    assert np.sqrt(by_sizes @ kept.covariance @ by_sizes) == pytest.approx(STATED_HEIGHT_SIGMA, rel=0.1)


@pytest.mark.slow
def test_an_own_body_stays_as_it_is(model):
    """Contours of the very body, from poses that are off: nothing makes the sizes differ."""
    fit = fit_sizes_to_contours(SizeParameters(model), sighted(model, model, range(4)), SizeFitSettings())
    assert fit.body.height_m == pytest.approx(1.7, rel=0.01)
    assert np.abs(thicknesses(fit.body) / thicknesses(model) - 1).max() < 0.03


@pytest.mark.slow
def test_the_time_of_a_late_view_is_heeded(model):
    """One of four views shows the body half a frame later: with its velocity the poses come out better."""
    speed = np.where(model.dof_is_length, 0.06, 0.12) * np.sign(np.sin(np.arange(model.n_dofs)))
    settings, off = SizeFitSettings(rounds=(Round(("height",), 1.0),)), {}
    for known in (speed, None):
        frames = []
        for f in sighted(model, model, range(2)):
            true = PosedBody(model, posed(model, f.frame), speed)
            (late,) = own_evidence([true.ahead(0.5)], CAMERAS[:1])
            views = (replace(late, ahead_frames=0.5), *f.views[1:])
            frames.append(f._replace(views=views, bodies=(replace(f.bodies[0], velocity=known),)))
        poses = fit_sizes_to_contours(SizeParameters(model), frames, settings).poses
        points = [
            model.points_world(p) - model.points_world(posed(model, f.frame))
            for p, f in zip(poses, frames, strict=True)
        ]
        off[known is None] = np.linalg.norm(points, axis=-1).mean()
    assert off[False] < 0.7 * off[True]


def test_frames_whose_errors_are_alike_count_as_fewer(model):
    parameters, frame = SizeParameters(model), sighted(model, model, [0])[0]
    kinds = ("height", "build", "length", "girth")

    def height_sigma(n_frames, correlation):
        settings = SizeFitSettings(rounds=(Round(kinds, 1.0, 0),), frame_correlation=correlation)
        return np.sqrt(fit_sizes_to_contours(parameters, [frame] * n_frames, settings).covariance[0, 0])

    alone = height_sigma(1, 0.3)
    assert height_sigma(4, 1.0) == pytest.approx(alone, rel=1e-6)
    assert height_sigma(4, 0.0) < height_sigma(4, 0.3) < alone


def test_unseen_parts_stay_as_uncertain_as_before(model):
    parameters = SizeParameters(model)
    nothing = [f._replace(views=()) for f in sighted(model, model, range(2))]
    fit = fit_sizes_to_contours(parameters, nothing, SizeFitSettings())
    np.testing.assert_allclose(fit.sizes, 0, atol=1e-6)
    np.testing.assert_allclose(np.sqrt(np.diag(fit.covariance)), parameters.sigmas, rtol=1e-6)


@pytest.mark.slow
def test_only_the_kinds_of_a_round_change():
    person, model = other_body(), load_model("gavrila22", 1.7)
    parameters = SizeParameters(model)
    settings = SizeFitSettings(rounds=(Round(("height",), 1.0),))
    fit = fit_sizes_to_contours(parameters, sighted(person, model, range(2)), settings)
    assert np.flatnonzero(fit.sizes).tolist() == [parameters.names.index("height")]


def test_the_fit_can_be_stopped(model):

    def stop(share):
        if share > 0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fit_sizes_to_contours(
            SizeParameters(model), sighted(other_body(), model, [0]), SizeFitSettings(), report=stop
        )  # fmt: skip


@pytest.mark.slow
def test_frames_that_differ_are_chosen():
    """Of nine frames alike and three unlike them, the three and one of the others."""
    model = load_model("gavrila34", 1.7)
    still = PosedBody(model, model.neutral())
    bodies = {k: (still,) for k in range(12)} | {k: (PosedBody(model, posed(model, k)),) for k in (3, 7, 9)}
    parameters = SizeParameters(model)
    assert choose_frames(parameters, CAMERAS, bodies, 0, 4) == [0, 3, 7, 9]
    assert choose_frames(parameters, CAMERAS, bodies, 0, 3, fixed=[0])[0] == 0
    assert len(choose_frames(parameters, CAMERAS, {0: (still,)}, 0, 3)) == 1


class _Staged:
    """An observer of one person whom all views show."""

    def __init__(self, person, poses):
        self._views = {k: own_evidence([PosedBody(person, p)], CAMERAS) for k, p in poses.items()}
        self.working_cameras, self.cameras = CAMERAS, []

    def ahead_frames(self, k):
        return (0.0,) * len(CAMERAS)

    def evidence(self, k, regions=None, predicted_px=None, static_edges=None):
        return self._views[k]


@pytest.fixture(scope="module")
def acquisition():
    person, model = other_body("gavrila34"), load_model("gavrila34", 1.7)
    poses = {k: posed(person, k) for k in range(4)}
    rng = np.random.default_rng(0)
    bodies = {k: (PosedBody(model, shaken(model, p, rng, 0.05, 0.02)),) for k, p in poses.items()}
    settings = AcquisitionSettings(n_frames=3)
    return acquire_from_contours(_Staged(person, poses), bodies, 0, {}, settings)


@pytest.mark.slow
def test_an_acquisition_fits_better_than_the_body_before(acquisition):
    assert len(acquisition.frames) == len(acquisition.poses) == 3
    assert acquisition.cost_after_px < 0.7 * acquisition.cost_before_px


@pytest.mark.slow
def test_a_body_says_how_well_its_joints_are_known(acquisition):
    """Those of a person whose joints are not known may lie elsewhere in the flesh."""
    assert acquisition.body.joint_sigma_m == pytest.approx(np.hypot(acquired_sigma_m(True), OTHER_BODY_M))


@pytest.mark.slow
def test_sizes_are_reported_with_their_uncertainty(acquisition):
    listed = size_changes(acquisition)
    rows = {r.name: r for r in listed}
    assert rows["height"].after_m == pytest.approx(acquisition.body.height_m)
    assert rows["height"].before_m == pytest.approx(1.7)
    thigh = rows["thigh, thickness side to side"]
    assert 0 < thigh.sigma_m < 0.2 * thigh.after_m
    changes = [abs(np.log(r.after_m / r.before_m)) for r in listed]
    assert changes == sorted(changes, reverse=True)


@pytest.mark.slow
def test_segments_are_those_of_the_poses_with_their_uncertainty(acquisition):
    segments = {s.name: s for s in acquired_segments(acquisition)}
    rows = {r.name: r for r in size_changes(acquisition)}
    for name in ("upper arm", "forearm", "thigh", "calf"):  # rigid, so that any pose shows them
        assert segments[name].length_m == pytest.approx(rows[f"{name}, length"].after_m, rel=0.02)
        assert segments[name].sigma_m == pytest.approx(rows[f"{name}, length"].sigma_m, rel=0.1)
    places = np.array([PosedBody(acquisition.body, p).joint_centers_world for p in acquisition.poses])
    shoulders = [acquisition.body.point_names.index(f"{side}_shoulder") for side in ("left", "right")]
    widths = np.linalg.norm(places[:, shoulders[0]] - places[:, shoulders[1]], axis=1)
    assert segments["shoulder width"].length_m == pytest.approx(np.median(widths))


@pytest.mark.slow
def test_joints_that_hardly_turn_are_said_to_be_unobservable(acquisition):
    model = acquisition.body
    poses = [model.neutral() for _ in range(3)]
    at = {n: i for i, n in enumerate(model.value_names)}
    poses[1][at["left_shoulder.abduction"]], poses[1][at["right_shoulder.twist"]] = np.radians([19, 90])
    poses[1][at["left_elbow.extension"]] = np.radians(31)
    poses[1][at["right_hip.flexion"]], poses[2][at["right_hip.flexion"]] = np.radians([25, -25])
    shown = acquisition._replace(poses=tuple(poses))
    assert {s.name: round(np.degrees(s.swing_rad)) for s in joint_swings(shown)} == {
        "shoulder": 19, "elbow": 31, "hip": 50, "knee": 0,
    }  # fmt: skip
    assert unobservable_joints(shown) == [
        "the shoulder turned by 19 degrees only, which does not show its centre",
        "the knee turned by 0 degrees only, which does not show its centre",
    ]
    assert unobservable_joints(shown._replace(joints_are_given=True)) == []


@pytest.mark.slow
def test_the_sizes_before_do_not_change_what_is_acquired(acquisition):
    """The prior is centred on typical proportions, not on a body that was fitted or typed in before."""
    person, model = other_body("gavrila34"), load_model("gavrila34", 1.7)
    poses = {k: posed(person, k) for k in range(4)}
    rng = np.random.default_rng(0)
    starts = {k: shaken(model, p, rng, 0.05, 0.02) for k, p in poses.items()}
    sizes = dimensions_of(model)
    longer = {n: p._replace(length_m=1.2 * p.length_m) if "arm" in n else p for n, p in sizes.parts.items()}
    other = with_dimensions(model, sizes._replace(parts=longer))
    bodies = {k: (PosedBody(other, retarget_pose(p, model, other)),) for k, p in starts.items()}
    found = acquire_from_contours(_Staged(person, poses), bodies, 0, {}, AcquisitionSettings(n_frames=3))
    np.testing.assert_allclose(lengths(found.body), lengths(acquisition.body), rtol=0.02)
    rows = {r.name: r for r in size_changes(found)}
    assert rows["forearm, length"].before_m == pytest.approx(longer["left_forearm"].length_m)


def test_a_body_where_nobody_is_gets_no_sizes():
    person, model = other_body(), load_model("gavrila22", 1.7)
    elsewhere = model.neutral()
    elsewhere[:3] += 50.0
    staged = _Staged(person, {0: elsewhere})
    with pytest.raises(TrackerError, match="no edges near the body"):
        acquire_from_contours(staged, {0: (PosedBody(model, elsewhere),)}, 0, {}, AcquisitionSettings())
    with pytest.raises(TrackerError, match="place the body"):
        acquire_from_contours(staged, {}, 0, {}, AcquisitionSettings())


@pytest.mark.slow
def test_the_height_of_a_child_is_the_stature():
    """Head and legs have other shares of the stature: the unit of the fractions is not how tall the child is."""
    model = load_model("gavrila22", 1.1)
    child = with_child_proportions(model)
    frames = sighted(child, model, range(2), placed=True)
    fit = fit_sizes_to_contours(SizeParameters(model), frames, SizeFitSettings())
    expected = model.height_m * stature_m(child) / stature_m(model)
    assert abs(expected / child.height_m - 1) > 0.02
    assert fit.body.height_m == pytest.approx(expected, rel=0.015)
    assert fit.body.height_m / stature_m(fit.body) == pytest.approx(model.height_m / stature_m(model), rel=1e-6)
    off = fit.body.points_world(fit.poses[0]) - frames[0].placed.targets_world
    assert np.linalg.norm(off, axis=1).mean() < 0.012


def with_child_proportions(model):
    """The body of a child of six: head and legs after Snyder et al. 1977."""
    sizes = dimensions_of(model)
    parts = dict(sizes.parts)
    for name in ("left_thigh", "right_thigh", "left_calf", "right_calf", "head"):
        length_m, girths_m = parts[name]
        by = 1.28 if name == "head" else 0.86
        parts[name] = PartDimensions(by * length_m, (girths_m[0] * max(by, 1), girths_m[1] * max(by, 1)))
    return with_dimensions(model, sizes._replace(parts=parts))
