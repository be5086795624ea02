"""Start poses of one person by each method, on figures with known joints that are unlike any body model."""

import numpy as np
import pytest
from figures import STANDING, UP, cameras_about_a_figure, figure, scene_of, silhouettes_of_figure

from tracker.errors import TrackerError
from tracker.estimation.initialization.generators.head_template import find_head
from tracker.estimation.initialization.generators.person_scene import silhouette_axes
from tracker.estimation.initialization.generators.start_generators import from_axis, from_search, from_voxels
from tracker.estimation.initialization.generators.stature import standing_height, upright_height
from tracker.evidence.voxels.geodesic_distance import neighbor_graph
from tracker.evidence.voxels.voxel_grid import Voxels
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.model_toml import load_model
from tracker.geometry.ground_plane import GroundPlane

CAMERAS = cameras_about_a_figure()
MODEL = load_model("gavrila34")
POSES = [pose | {"noise": 0.05} for pose in STANDING]


def scene(voxels, **changes):
    return scene_of(voxels, silhouettes_of_figure(voxels, CAMERAS), **changes)


def error_mm(candidate, joints):
    model = candidate.model
    own = model.named_points_world(candidate.pose)
    return 1000 * float(np.mean([np.linalg.norm(own[n] - joints[n]) for n in LIMB_JOINTS]))


@pytest.mark.slow
def test_the_axis_gives_starts():
    errors = []
    for pose in POSES:
        voxels, joints = figure(**pose)
        found = from_axis(scene(voxels), MODEL, False)
        left = joints["left_shoulder"] - joints["right_shoulder"]
        sides = [np.cross(UP, h.forward) @ left / np.linalg.norm(left) for h in found]
        assert min(sides) < -0.7  # the figure looks the same from behind
        ahead = min((h for h, side in zip(found, sides, strict=True) if side > 0.7), key=lambda h: error_mm(h, joints))
        errors.append(error_mm(ahead, joints))
    assert np.mean(errors) < 80
    assert max(errors) < 120


@pytest.mark.slow
def test_voxels_give_both_ways_of_facing():
    voxels, joints = figure(**POSES[1])
    ahead, back = sorted(from_voxels(scene(voxels), MODEL, False), key=lambda h: error_mm(h, joints))
    assert ahead.faces_away_from(back)
    assert error_mm(ahead, joints) < 80 < error_mm(back, joints)
    assert ahead.is_measured
    assert ahead.model.height_m == pytest.approx(1.74, abs=0.05)


@pytest.mark.slow
def test_a_known_height_stays():
    assert from_voxels(scene(figure()[0]), MODEL, True)[0].model is MODEL


@pytest.mark.slow
def test_a_search_needs_no_head_that_stands_out():
    voxels, joints = figure(arms_deg=150)  # the upper arms lie beside the head
    found = from_search(scene(voxels), MODEL, True)
    assert min(error_mm(c, joints) for c in found) < 150


@pytest.mark.slow
@pytest.mark.parametrize("arms_deg", [20, 90, 175])
def test_raised_arms_do_not_make_a_person_taller(arms_deg):
    voxels, joints = figure(arms_deg=arms_deg)
    top = joints["head"] + (0.0, 0.0, 0.125)
    soles_m = joints["left_ankle"][2] - 0.07
    height_m = standing_height(scene(voxels), UP, top, find_head(voxels, neighbor_graph(voxels)))
    assert height_m == pytest.approx(top[2] - soles_m, abs=0.03)


@pytest.mark.slow
def test_shoes_that_a_shadow_hides_do_not_make_a_person_smaller():
    voxels, joints = figure()
    floor_m = joints["left_ankle"][2] - 0.07
    heights = voxels.points_world[:, 2]
    barefoot = scene(voxels.without(heights < floor_m + 0.10))._replace(floor=GroundPlane(UP, floor_m))
    top = joints["head"] + (0.0, 0.0, 0.125)
    hidden = [b.mask & ~a.mask for a, b in zip(barefoot.silhouettes, scene(voxels).silhouettes, strict=True)]
    shaded = [s._replace(shadow=h) for s, h in zip(barefoot.silhouettes, hidden, strict=True)]
    assert standing_height(barefoot._replace(silhouettes=shaded), UP, top) == pytest.approx(top[2] - floor_m, abs=0.01)
    # Where one view shows the floor below the feet, the person stands on something or jumps.
    shaded[0] = barefoot.silhouettes[0]
    height_m = standing_height(barefoot._replace(silhouettes=shaded), UP, top)
    assert height_m == pytest.approx(top[2] - floor_m - 0.10, abs=0.03)


@pytest.mark.slow
def test_a_figure_with_a_large_hand_has_two_possible_heads():
    voxels, joints = figure(arms_deg=45)
    points = voxels.grid.centers(np.argwhere(np.ones(voxels.grid.shape, dtype=bool)))
    hand = joints["left_wrist"] + 0.25 * (joints["left_wrist"] - joints["left_shoulder"])
    ball = (np.linalg.norm(points - hand, axis=1) < 0.105).reshape(voxels.grid.shape)
    own = scene(Voxels(voxels.grid, voxels.occupied | ball))
    assert np.linalg.norm(find_head(own.figure, neighbor_graph(own.figure)).center - hand) < 0.08
    found = from_voxels(own, MODEL, True)
    assert len(found) == 4
    assert min(error_mm(c, joints) for c in found) < 80
    assert upright_height(own) == pytest.approx(1.74, abs=0.05)


def test_a_person_who_lies_or_crouches_has_no_standing_height():
    voxels, joints = figure()
    top = joints["head"] + (0.0, 0.0, 0.125)
    assert standing_height(scene(voxels), np.array([1.0, 0.0, 0.0]), top) is None
    head = find_head(voxels, neighbor_graph(voxels))
    assert standing_height(scene(voxels), UP, top, head._replace(path_m=1.3 * head.path_m)) is None
    assert standing_height(scene(voxels), UP, top, head._replace(neck=head.neck - (0.0, 0.0, 0.10))) is None


@pytest.mark.slow
def test_views_in_which_others_stand_before_the_person_are_left_out():
    own = scene(figure()[0])
    masks = [m._replace(is_apart=i > 0) for i, m in enumerate(own.masks)]
    assert [a.camera.name for a in silhouette_axes(own._replace(masks=masks))] == ["c1", "c2", "c3"]
    once = [m._replace(is_apart=i == 0) for i, m in enumerate(own.masks)]
    assert [c.name for _, c in own._replace(masks=once).clear_views] == ["c0", "c1", "c2", "c3"]
    nothing = [m._replace(mask=np.zeros_like(m.mask)) for m in own.masks]
    with pytest.raises(TrackerError, match="the person in at least 2 views"):
        silhouette_axes(own._replace(masks=nothing))
