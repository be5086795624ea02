"""Bodies that touch: nothing passes through a trunk, and hands are where they hold."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tracker.formats.model_toml import load_model
from tracker.simulate.motion.postures import solve_posture
from tracker.simulate.motion.scenes import cast_of
from tracker.simulate.people.anatomy import bone_names
from tracker.simulate.people.skeleton import altered_model
from tracker.simulate.people.skin import make_skin
from tracker.simulate.stage.rasterizer import vertex_normals

pytestmark = pytest.mark.slow

MAN, WOMAN = 0, 1


@pytest.fixture(scope="module")
def skins():
    """The man's and the woman's, who are the same in every scene of two."""
    return [
        make_skin(altered_model(load_model("gavrila22", r.height_m), r.build.bone_factors), r.outfit, r.build)
        for r in cast_of("tango")
    ]


def posed(scene, skins, frames):
    """Vertices of both at some frames."""
    cast = cast_of(scene)
    poses = [solve_posture(role, skin.model, max(frames) + 1, 25.0) for role, skin in zip(cast, skins, strict=True)]
    return [[skin.posed(own[k]) for skin, own in zip(skins, poses, strict=True)] for k in frames]


def bones(skin):
    """Name of the bone that each vertex follows most."""
    return np.array(bone_names(skin.model))[np.argmax(skin.weights, axis=1)]


def depths(vertices, skins, one, other):
    """How deep the vertices of one person are within the other, metres; negative outside, -inf far away."""
    tree = cKDTree(vertices[other])
    distances, nearest = tree.query(vertices[one], distance_upper_bound=0.12)
    near = np.isfinite(distances)
    normals = vertex_normals(vertices[other], skins[other].faces)[nearest[near]]
    out = np.full(len(distances), -np.inf)
    out[near] = np.sum((vertices[other][nearest[near]] - vertices[one][near]) * normals, axis=1)
    return out, nearest


@pytest.mark.parametrize("scene", ["tango", "couple_touching", "couple_overlapping"])
def test_no_limb_goes_through_the_others_trunk_and_limbs_hardly_into_limbs(skins, scene):
    for vertices in posed(scene, skins, (0, 9, 17, 26, 34)):
        for one, other in ((MAN, WOMAN), (WOMAN, MAN)):
            into, nearest = depths(vertices, skins, one, other)
            # Flesh gives way by a centimetre; hands that hold each other interlace their fingers.
            trunk = np.isin(bones(skins[other])[np.where(np.isfinite(into), nearest, 0)], ("torso", "head"))
            assert into[trunk].max(initial=-np.inf) < 0.012
            assert into.max() < 0.035


def test_the_hold_of_the_tango_touches_where_it_should(skins):
    for vertices in posed("tango", skins, (0, 13, 41)):
        who = [bones(skin) for skin in skins]
        his_hand = vertices[MAN][(who[MAN] == "right_forearm")]
        her_trunk = cKDTree(vertices[WOMAN][who[WOMAN] == "torso"])
        assert her_trunk.query(his_hand)[0].min() < 0.03
        her_hand = vertices[WOMAN][who[WOMAN] == "left_forearm"]
        assert cKDTree(vertices[MAN][who[MAN] == "torso"]).query(her_hand)[0].min() < 0.02
        joined = cKDTree(vertices[MAN][who[MAN] == "left_forearm"]).query(
            vertices[WOMAN][who[WOMAN] == "right_forearm"]
        )
        assert joined[0].min() < 0.02
        trunks = cKDTree(vertices[MAN][who[MAN] == "torso"]).query(vertices[WOMAN][who[WOMAN] == "torso"])[0].min()
        assert 0.04 < trunks < 0.12, "a hand's breadth between the trunks"


def test_pressed_bodies_touch(skins):
    (vertices,) = posed("couple_overlapping", skins, (5,))
    trunks = [v[bones(skin) == "torso"] for v, skin in zip(vertices, skins, strict=True)]
    assert cKDTree(trunks[MAN]).query(trunks[WOMAN])[0].min() < 0.02


def test_a_man_and_a_woman_are_built_differently_at_one_height():
    man, woman = (r.build for r in cast_of("tango"))
    bodies = [altered_model(load_model("gavrila22", 1.7), b.bone_factors) for b in (man, woman)]
    preset = load_model("gavrila22", 1.7)
    for joint in ("left_elbow", "left_knee", "neck"):
        his, hers, plain = (np.linalg.norm({j.name: j.position for j in m.joints}[joint]) for m in (*bodies, preset))
        assert (his / plain - 1.0) * (hers / plain - 1.0) < 0
        assert min(abs(his / plain - 1.0), abs(hers / plain - 1.0)) > 0.045
    thick = [
        sum(r for lobe in b.flesh(m) if "arm" in lobe.bone for r in lobe.radii)
        for b, m in zip((man, woman), bodies, strict=True)
    ]
    assert thick[1] < 0.92 * thick[0]
    assert len(woman.flesh(bodies[1])) > len(man.flesh(bodies[0]))
