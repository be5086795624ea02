"""Shapes from a frontal and a side view: a known superquadric is found, and views that do not show it are refused."""

from dataclasses import replace

import numpy as np
import pytest
from staging import camera_at, edge_map, in_posture, own_evidence, view_evidence

from tracker.body.dimensions import dimensions_of
from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.estimation.acquisition.shape_search import (
    ChamferSearchSettings,
    back_project_contours,
    chamfer_distance_m,
    explained_points,
    polar_plane,
    search_shapes,
)
from tracker.estimation.acquisition.size_fit import SightedPerson
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.estimation.acquisition.two_views import MAX_OFF_RAD, TwoViewSettings, acquire_from_two_views, choose_views
from tracker.evidence.contours import occluding_contours
from tracker.formats.model_toml import parse_model

ROUND = [camera_at(name, (4 * np.cos(a), 4 * np.sin(a), 0.3))
         for name, a in (("front", 0.1), ("side", np.pi / 2 - 0.05), ("oblique", np.pi / 4))]  # fmt: skip


def single(half_axes, exponents=(0.6, 0.8), taper=(0.0, 0.0)):
    """A body of one tapered superquadric that stands upright, 1 m as its height."""
    return parse_model(
        f"""
        version = 1
        name = "single"
        height_m = 1.0
        [[parts]]
        name = "trunk"
        half_axes = {list(half_axes)}
        exponents = {list(exponents)}
        taper = {list(taper)}
        [[joints]]
        name = "root"
        child = "trunk"
        free = true
        axes = [{{ name = "twist", axis = [0, 0, 1] }}]
        [[search]]
        name = "place"
        dofs = ["root.x"]
        """,
        "single",
    )


def noisy(views, seed=0):
    """The same views with edge points that are off by half a pixel."""
    rng = np.random.default_rng(seed)
    return [replace(v, points_px=(v.points_px + rng.normal(0, 0.5, v.points_px.shape)).astype(np.float32))
            for v in views]  # fmt: skip


@pytest.mark.slow
def test_a_known_superquadric_is_found():
    true = single((0.16, 0.23, 0.33), taper=(0.12, -0.1))
    model = single((0.13, 0.27, 0.33), taper=(0.0, 0.01))
    views = noisy(own_evidence([PosedBody(true, true.neutral())], ROUND[:2]))
    sighted = SightedPerson(0, views, (PosedBody(model, model.neutral()),), 0)
    parameters = SizeParameters(model, coupled=False)  # coupled sides leave the taper from side to side
    result = search_shapes(parameters, sighted, ChamferSearchSettings())
    shape, expected = parameters.body(result.sizes).shapes[0], true.shapes[0]
    np.testing.assert_allclose(shape.half_axes, expected.half_axes, rtol=0.03)
    np.testing.assert_allclose(shape.taper, expected.taper, atol=0.04)
    assert result.chamfer_after_m < 0.01 < result.chamfer_before_m


@pytest.mark.slow
def test_the_girths_of_another_person_are_found(model):
    parameters = SizeParameters(model)
    sizes = np.random.default_rng(5).normal(size=len(parameters.names)) * parameters.sigmas
    sizes[~parameters.of_kinds("girth")] = 0.0
    person, pose = parameters.body(sizes), in_posture(model)
    views = noisy(own_evidence([PosedBody(person, pose)], ROUND[:2]))
    result = search_shapes(
        parameters, SightedPerson(0, views, (PosedBody(model, pose),), 0), ChamferSearchSettings()
    )  # fmt: skip
    was, now, true = (dimensions_of(b).parts for b in (model, parameters.body(result.sizes), person))
    parts = ("torso", "head", "left_upper_arm", "left_thigh", "left_calf")
    off = [np.mean([np.abs(np.log(np.divide(d[p].girths_m, true[p].girths_m))) for p in parts]) for d in (was, now)]
    assert off[1] < 0.04 < off[0]
    body = parameters.body(result.sizes)
    np.testing.assert_allclose(body.points_world(pose), model.points_world(pose))  # joints stay


def test_contours_are_back_projected_to_where_they_arise(model):
    body = PosedBody(model, in_posture(model))
    contour = occluding_contours.trace([body], ROUND[0])
    for name in ("head", "left_thigh"):
        part = model.part_index[name]
        own = (contour.parts == part) & ~contour.occluded
        points = polar_plane(ROUND[0], body, part).cut(contour.points_world[own])
        assert np.linalg.norm(points - contour.points_world[own], axis=1).mean() < 0.01
        np.testing.assert_allclose(ROUND[0].project(points), ROUND[0].project(contour.points_world[own]), atol=1e-3)


def test_contours_are_back_projected_at_the_time_of_their_picture(model):
    step = np.zeros(model.n_dofs)
    step[:3] = 0.3, -0.2, 0.1
    body = PosedBody(model, in_posture(model), step)
    late = PosedBody(model, model.retract(body.values, 0.5 * step))
    views = own_evidence([late], ROUND[:2])
    after = [replace(v, ahead_frames=0.5) for v in views]
    found = back_project_contours(SightedPerson(0, after, (body,), 0))
    expected = back_project_contours(SightedPerson(0, views, (late,), 0))
    assert len(found) == len(expected) > 5
    for a, b in zip(found, expected, strict=True):
        np.testing.assert_allclose(a.points_world, b.points_world)


def test_points_belong_to_the_part_that_explains_them(model):
    body = PosedBody(model, in_posture(model))
    (view,) = own_evidence([body], ROUND[:1])
    points, _ = explained_points(view, [body])
    assert len(points) > 0.95 * len(view.points_px)
    apart = PosedBody(model, in_posture(model) + np.eye(len(model.value_names))[1])
    assert len(explained_points(view, [apart])[0]) < 0.2 * len(view.points_px)
    # A second person takes the points nearest to the own contour.
    both = explained_points(view, [apart, body])[1]
    assert (both >= len(model.parts)).mean() > 0.9
    nothing = view_evidence(view.camera, edge_map([body], view.camera) & False)
    assert back_project_contours(SightedPerson(0, [nothing], (body,), 0)) == []


def test_the_chamfer_distance_counts_both_directions():
    line = np.stack([np.linspace(0, 1, 101), np.zeros(101), np.zeros(101)], axis=1)
    assert chamfer_distance_m(line, line + np.array([0, 0.02, 0]), 0.05) == pytest.approx(0.02, rel=1e-4)
    # Half of the line is near its first half, but all of that half is near the line.
    assert chamfer_distance_m(line[:51], line, 0.05) == pytest.approx(chamfer_distance_m(line, line[:51], 0.05))
    assert chamfer_distance_m(line[:51], line, 0.05) == pytest.approx(0.5 * np.minimum(line[:51, 0], 0.05).sum() / 101)
    assert chamfer_distance_m(line[:2], line, 0.05) == 0.05


def turned(model, radians):
    pose = model.neutral()
    pose[model.value_names.index("torso.twist")] = radians
    return (PosedBody(model, pose),)


def test_views_are_chosen_by_the_heading(model):
    bodies = {4: turned(model, np.pi / 4), 7: turned(model, 0.0)}
    found = choose_views(ROUND, bodies, 0)
    assert found[:3] == (7, 0, 1)
    assert 0.05 < found.off_rad < 0.2
    # Turned to the left by a right angle, the former side view is in front.
    assert choose_views(ROUND, {2: turned(model, np.pi / 2)}, 0)[:3] == (2, 1, 0)
    assert choose_views(ROUND, bodies, 0, ("front", "side"))[:3] == (7, 0, 1)


def test_views_that_are_not_near_orthogonal_are_refused(model):
    upright = {0: turned(model, 0.0)}
    with pytest.raises(TrackerError, match="front and oblique show the person"):
        choose_views(ROUND, upright, 0, ("front", "oblique"))
    with pytest.raises(TrackerError, match=f"within {np.degrees(MAX_OFF_RAD):.0f} degrees"):
        choose_views(ROUND, {0: turned(model, np.pi / 4)}, 0)
    with pytest.raises(TrackerError, match="too few views"):
        choose_views(ROUND[:1], upright, 0)


class _Staged:
    """An observer of one person."""

    def __init__(self, person, pose):
        self.working_cameras, self.cameras = ROUND, []
        self._views = own_evidence([PosedBody(person, pose)], ROUND)

    def ahead_frames(self, k):
        return (0.0,) * len(ROUND)

    def evidence(self, k, regions=None, predicted_px=None, static_edges=None):
        return self._views


def test_an_acquisition_names_its_frame_and_views(model):
    pose, stages = in_posture(model), []
    settings = TwoViewSettings(search=ChamferSearchSettings(levels=1, passes=1))
    bodies = {3: (PosedBody(model, pose),)}
    found = acquire_from_two_views(
        _Staged(model, pose), bodies, 0, settings, lambda stage, share, *_: stages.append(share)
    )
    assert (found.frames, found.views) == ((3,), ("front", "side"))
    assert stages == sorted(stages)
    assert found.cost_after_px == pytest.approx(found.cost_before_px, abs=0.3)
    assert np.isnan(found.fit.covariance).all()
    elsewhere = pose.copy()
    elsewhere[:3] += 40.0
    with pytest.raises(TrackerError, match="no edges near the body"):
        acquire_from_two_views(_Staged(model, elsewhere), bodies, 0, settings)
    with pytest.raises(TrackerError, match="place the body"):
        acquire_from_two_views(_Staged(model, pose), {}, 0, settings)
