from dataclasses import replace

import numpy as np
import pytest
from bodies import BALLS

from tracker.errors import ModelError
from tracker.formats.model_toml import DEFAULT_HEIGHT_M, PRESETS, format_model, load_model, parse_model
from tracker.geometry.shapes import Ellipsoid, EllipticalCone

SMALL = """
version = 1
name = "small"
[[search]]
name = "all"
dofs = ["root.*", "hinge.bend"]
[[joints]]
name = "hinge"
parent = "trunk"
child = "arm"
axes = [{ name = "bend", axis = [0, 2, 0], limits_deg = [0, 90] }]
[[joints]]
name = "root"
child = "trunk"
free = true
axes = [{ name = "turn", axis = [0, 0, 1] }]
[[landmarks]]
name = "tip"
part = "arm"
position = [0, 0, -0.1]
[[parts]]
name = "arm"
half_axes = [0.1, 0.1, 0.1]
[[parts]]
name = "trunk"
half_axes = [0.2, 0.2, 0.2]
"""


def test_joints_come_parent_first_and_parts_in_their_order():
    model = parse_model(SMALL, "x")
    assert [j.name for j in model.joints] == ["root", "hinge"]
    assert [p.name for p in model.parts] == ["trunk", "arm"]
    assert model.parents == (-1, 0)
    assert model.joints[1].axes[0].direction == (0.0, 1.0, 0.0)  # made a unit vector
    np.testing.assert_allclose(model.limits[-1], [0, np.pi / 2])
    assert model.limits[3].tolist() == [-np.inf, np.inf]
    assert model.search_groups[0].dofs == ("root.x", "root.y", "root.z", "root.turn", "hinge.bend")


def test_spread():
    model = parse_model(SMALL.replace("limits_deg = [0, 90]", "limits_deg = [0, 90], spread_deg = 30"), "x")
    np.testing.assert_allclose(model.spreads, [*[np.inf] * 4, np.pi / 6])
    assert np.isinf(parse_model(SMALL, "x").spreads).all()
    assert "spread_deg" not in format_model(parse_model(SMALL, "x"))


def test_without_groups_one_holds_everything():
    model = parse_model(BALLS, "x")
    assert [g.dofs for g in model.search_groups] == [model.dof_names]


def test_height():
    assert parse_model(SMALL, "x").height_m == DEFAULT_HEIGHT_M
    assert parse_model(BALLS, "x").height_m == 2.0
    assert parse_model(BALLS, "x", 1.5).height_m == 1.5
    assert load_model("gavrila22", 1.62).height_m == 1.62


def models():
    return [load_model(n, 1.63) for n in PRESETS] + [parse_model(SMALL, "x"), parse_model(BALLS, "x")]


@pytest.mark.parametrize("model", models(), ids=lambda m: m.name)
def test_round_trip(model):
    again = parse_model(format_model(model), "again")
    assert (again.name, again.height_m) == (model.name, model.height_m)
    assert (again.parts, again.landmarks, again.search_groups) == (model.parts, model.landmarks, model.search_groups)
    assert again.value_names == model.value_names
    np.testing.assert_allclose(again.limits, model.limits, atol=1e-15)
    np.testing.assert_allclose(again.spreads, model.spreads, atol=1e-15)
    for a, b in zip(again.joints, model.joints, strict=True):
        assert (a.name, a.parent, a.child, a.position, a.kind, a.free) == (
            b.name,
            b.parent,
            b.child,
            b.position,
            b.kind,
            b.free,
        )
        np.testing.assert_allclose([a.cone, a.twist], [b.cone, b.twist], atol=1e-15)
    values = model.retract(model.neutral(), np.linspace(-1, 1, model.n_dofs))
    np.testing.assert_allclose(again.points_world(values), model.points_world(values), atol=1e-12)


def test_from_a_file(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    assert load_model(path).name == load_model(str(path)).name == "small"


@pytest.mark.parametrize("name", ["gavrila23", "small.txt", "none.toml"])
def test_unknown_model(name):
    with pytest.raises(ModelError, match=f"'{name}' not found: expected one of .*gavrila22"):
        load_model(name)


LOOP = """
[[joints]]
name = "a"
parent = "hand"
child = "finger"
[[joints]]
name = "b"
parent = "finger"
child = "hand"
[[parts]]
name = "finger"
half_axes = [1, 1, 1]
[[parts]]
name = "hand"
half_axes = [1, 1, 1]
"""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (SMALL + LOOP, "the joints a, b form a loop"),
        (
            SMALL.replace('parent = "trunk"', 'parent = "tail"'),
            "'hinge' hangs on a missing parent part 'tail'.*arm, trunk",
        ),
        (SMALL.replace('parent = "trunk"', ""), r"one joint without a parent, found \['hinge', 'root'\]"),
        (SMALL.replace("version = 1", "version = 2"), "version 2, this program reads up to 1; upgrade"),
        (SMALL.replace('name = "hinge"', "name = "), "line 8"),
        (SMALL.replace('name = "small"', ""), "expected the key 'name', found none"),
        (SMALL.replace('child = "arm"', ""), r"expected the key 'child' in 'joints\[hinge\]', found none"),
        (SMALL.replace('part = "arm"', 'part = "leg"'), "landmark 'tip' is on a missing part 'leg'"),
        (SMALL.replace("[0, 2, 0]", "[0, 0, 0]"), r"direction other than 0 .* in 'joints\[hinge\].axes\[bend\]'"),
        (SMALL.replace("[0, 90]", "[10, 90]"), r"a lower limit up to 0 and an upper one from 0 as .*found \[10, 90\]"),
        (SMALL.replace("[0, 90]", "[0, 90], spread_deg = 0"), r"above 0 as .*axes\[bend\].spread_deg', found 0"),
        (SMALL.replace("[0, 90]", "[0, 90], spread_deg = nan"), "a number above 0 as .*spread_deg', found nan"),
        (SMALL.replace("[0, 0, -0.1]", "[0, 0]"), r"expected 3 finite numbers.* as 'landmarks\[tip\].position'"),
        (SMALL.replace("[0, 0, -0.1]", "[0, 0, nan]"), r"expected 3 finite numbers.* as 'landmarks\[tip\].position'"),
        (SMALL.replace("[0.1, 0.1, 0.1]", "[0.1, 0.1, -0.1]"), r"3 half-axes above 0.* as 'parts\[arm\].half_axes'"),
        (SMALL.replace("free = true", 'kind = "slide"'), r"'ball', 'revolute' as 'joints\[root\].kind', found 'slide'"),
        (SMALL.replace('["root.*", "hinge.bend"]', "3"), r"1 to 256 names as 'search\[all\].dofs', found 3"),
        (SMALL.replace('"hinge.bend"', "7"), r"a name .* as 'search\[all\].dofs\[1\]', found 7"),
        (SMALL.replace('"hinge.bend"', '"root.x"'), "search group 'all' names 'root.x' twice"),
        (SMALL.replace('child = "arm"', "child = [1]"), r"a name .* as 'joints\[hinge\].child', found \[1\]"),
        (SMALL.replace("version = 1", "version = inf"), "'version': expected a whole number.* found inf"),
        (SMALL.replace("version = 1", "version = -1"), "'version'"),
        (SMALL.replace("free = true", "free = 1"), r"true or false as 'joints\[root\].free', found 1"),
        (SMALL.replace("free = true", "fixed = true"), r"only name, child, .* in 'joints\[root\]', found 'fixed'"),
        (SMALL.replace('name = "arm"', 'name = "arm"\ncolor = "red"'), "a colour such as #f2a33a .*found 'red'"),
        (SMALL.replace("[0.1, 0.1, 0.1]", f"[0.1, 0.1, 0x{'f' * 9999}]"), "half-axes above 0"),
        (SMALL.replace("[0.1, 0.1, 0.1]", f"[0.1, 0.1, {'9' * 9999}]"), "not valid TOML"),
        (SMALL.replace('name = "tip"', 'name = "hinge"'), "each joint and landmark once, found 'hinge' twice"),
        ("name = " + "[" * 9999, "at most 32 levels of nesting"),
        (".".join("a" * 99) + " = 1", "at most 32 levels of nesting"),
        (SMALL.replace('"hinge.bend"', '"hinge.bent"'), "search group 'all' names an unknown dof 'hinge.bent'"),
        (SMALL + '[[parts]]\nname = "tail"\nhalf_axes = [1, 1, 1]\n', "one joint for each part, but see: tail"),
        ('name = "x"\njoints = 3\nparts = 4\n', "1 to 128 joints as 'joints', found 3"),
        ("", "expected the key 'name'"),
    ],
)
def test_malformed(text, expected):
    with pytest.raises(ModelError, match=expected) as caught:
        parse_model(text, "mine.toml")
    assert "mine.toml" in str(caught.value)


def test_two_joints_for_one_part():
    text = SMALL.replace('dofs = ["root.*", "hinge.bend"]', 'dofs = ["root.*"]')
    with pytest.raises(ModelError, match="one joint for each part, but see: arm"):
        parse_model(text + '[[joints]]\nname = "c"\nparent = "trunk"\nchild = "arm"\n', "x")


@pytest.mark.parametrize("height", [0.0, -1.0, 17.5, float("nan")])
def test_impossible_heights(height):
    with pytest.raises(ModelError, match=r"height of 0\.3 to 3 metres"):
        parse_model(SMALL, "x", height)


KINDS = SMALL.replace('name = "arm"\nhalf_axes', 'name = "arm"\nshape = "cone"\ntaper = 0.3\nhalf_axes').replace(
    'name = "trunk"\nhalf_axes', 'name = "trunk"\nshape = "ellipsoid"\nhalf_axes'
)


def test_shapes_of_parts():
    model = parse_model(KINDS, "x", 2.0)
    assert model.shapes == (Ellipsoid((0.4, 0.4, 0.4)), EllipticalCone((0.2, 0.2, 0.2), 0.3))
    again = parse_model(format_model(model), "again")
    assert again.parts == model.parts
    assert again.shapes == model.shapes


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (KINDS.replace('"cone"', '"cube"'), r"'superquadric' as 'parts\[arm\].shape', found 'cube'"),
        (KINDS.replace("taper", "exponents = [1, 1]\ntaper"), "no exponents of the shape cone.*; leave them out"),
        (KINDS.replace('"cone"', '"ellipsoid"'), "taper of part 'arm': expected no taper of an ellipsoid, found 0.3"),
        (KINDS.replace("taper = 0.3", "taper = 0.95"), "a taper within 0.9, found 0.95"),
        (KINDS.replace("taper = 0.3", "taper = [0.3, 0.3]"), r"a taper within 0.9, found \[0.3, 0.3\]"),
    ],
)
def test_malformed_shapes(text, expected):
    with pytest.raises(ModelError, match=expected):
        parse_model(text, "mine.toml")


def test_the_cones_stand_where_gavrilas_parts_do():
    model, cones = load_model("gavrila22"), load_model("gavrila22_cones")
    assert cones.joints == model.joints
    assert cones.landmarks == model.landmarks
    assert cones.search_groups == model.search_groups
    for part, other in zip(cones.parts, model.parts, strict=True):
        assert (part.name, part.half_axes, part.center) == (other.name, other.half_axes, other.center)
        assert part.kind == ("ellipsoid" if part.name == "head" else "cone")


def test_joint_centers_are_read_and_written_with_their_source():
    text = SMALL
    for key, offset, source in (('child = "arm"', "[0, 0.01, 0.02]", "A"), ('part = "arm"', "[0.03, 0, 0]", "B")):
        text = text.replace(key, f'{key}\ncenter_offset = {offset}\ncenter_source = "{source}"')
    model = parse_model(text, "x")
    assert (model.joints[1].center_offset, model.joints[1].center_source) == ((0.0, 0.01, 0.02), "A")
    assert (model.landmarks[0].center_offset, model.landmarks[0].center_source) == ((0.03, 0.0, 0.0), "B")
    back = parse_model(format_model(model), "y")
    assert (back.joints, back.landmarks) == (model.joints, model.landmarks)


def test_a_model_without_joint_centers_is_written_as_before():
    """An older program refuses unknown keys."""
    model = parse_model(SMALL, "x")
    assert not model.center_offsets.any()
    assert "center_" not in format_model(model)


def test_how_well_joints_are_known_is_read_and_written():
    model = parse_model(SMALL, "x")
    assert model.joint_sigma_m is None
    assert "sigma" not in format_model(model)
    assert parse_model(format_model(replace(model, joint_sigma_m=0.006)), "y").joint_sigma_m == 0.006
    with pytest.raises(ModelError, match=r"joint_sigma_m.*found -0.01"):
        parse_model(f"joint_sigma_m = -0.01\n{SMALL}", "z")


@pytest.mark.parametrize("key", ["position = [0, 0, -0.1]", 'child = "arm"'])
def test_a_joint_center_without_a_source_is_refused(key):
    with pytest.raises(ModelError, match=r"expected the source of 'center_offset' as 'center_source' in .*found none"):
        parse_model(SMALL.replace(key, f"{key}\ncenter_offset = [0, 0, 0.1]"), "x")
