import numpy as np

from app.drawing.curves import GROUPS, Plot, plots_of, samples
from tracker.formats.model_toml import parse_model
from tracker.session.store.records import FramePose

CAMERAS = ("front", "left")


def by_title(model, group):
    return {p.title: p for p in plots_of(model, CAMERAS, group)}


def test_arms_are_those_of_the_paper(gavrila):
    """GD96 Fig. 8: abduction, elevation, twist and extension of each arm."""
    plots = by_title(gavrila, "arms")
    assert list(plots) == ["Left arm", "Right arm"]
    for side in ("left", "right"):
        plot = plots[f"{side.capitalize()} arm"]
        assert plot.unit == "deg"
        assert plot.labels == ("abduction", "elevation", "twist", "extension")
        names = [gavrila.dof_names[d] for d in plot.dofs]
        assert names == [f"{side}_shoulder.{n}" for n in plot.labels[:3]] + [f"{side}_elbow.extension"]


def test_torso_has_angles_and_coordinates(gavrila):
    plots = by_title(gavrila, "torso")
    assert (plots["Angles"].unit, plots["Angles"].labels) == ("deg", ("abduction", "elevation", "twist"))
    assert (plots["Position"].unit, plots["Position"].labels) == ("cm", ("x", "y", "z"))


def test_every_degree_of_freedom_is_in_one_plot(gavrila):
    dofs = [d for group in GROUPS for plot in plots_of(gavrila, CAMERAS, group) for d in plot.dofs]
    assert sorted(dofs) == list(range(gavrila.n_dofs))


BALLS = """
version = 1
name = "balls"
height_m = 1.8
joints = [
    { name = "root", child = "trunk", free = true, kind = "ball" },
    { name = "left_shoulder", parent = "trunk", child = "arm", position = [0, 0.1, 0.2], kind = "ball" },
    { name = "left_wrist", parent = "arm", child = "hand", position = [0, 0, -0.3], kind = "ball" },
]
parts = [
    { name = "trunk", half_axes = [0.1, 0.1, 0.2], exponents = [0.5, 1.0], color = "#ffffff" },
    { name = "arm", half_axes = [0.05, 0.05, 0.1], exponents = [0.5, 1.0], color = "#ffffff" },
    { name = "hand", half_axes = [0.02, 0.02, 0.05], exponents = [0.5, 1.0], color = "#ffffff" },
]
"""


def test_ball_joints_are_rotation_vectors_named_by_their_joint():
    model = parse_model(BALLS, "balls")
    plots = by_title(model, "arms")
    assert list(plots) == ["Left arm"]
    assert plots["Left arm"].labels == (
        "shoulder rx", "shoulder ry", "shoulder rz", "wrist rx", "wrist ry", "wrist rz",
    )  # fmt: skip
    values = model.neutral()
    at = model.value_names.index("left_wrist.qw")
    values[at : at + 4] = np.cos(np.radians(15)), 0.0, np.sin(np.radians(15)), 0.0
    found = samples(model, [plots["Left arm"]], [0], [FramePose(0, values, None, ())])
    np.testing.assert_allclose(found[:, 0], [0, 0, 0, 0, 30, 0], atol=1e-4)


def test_values_are_in_degrees_and_centimetres_with_gaps(gavrila):
    values = np.zeros(22)
    values[:4] = 1.5, -0.25, 0.9, np.pi / 2
    rows = [FramePose(3, values, 1.0, ()), FramePose(7, np.zeros(9), 1.0, ())]  # the latter of another body
    plots = plots_of(gavrila, CAMERAS, "torso")
    found = samples(gavrila, plots, [3, 5, 7], rows)
    assert found.shape == (6, 3)
    np.testing.assert_allclose(found[:, 0], [90, 0, 0, 150, -25, 90], atol=1e-4)
    assert np.all(np.isnan(found[:, 1:]))


def test_costs_are_the_mean_and_the_views(gavrila):
    plots = plots_of(gavrila, CAMERAS, "cost")
    assert plots == [Plot("Cost", "px", ("mean", "front", "left"), ())]
    zero = np.zeros(22)
    rows = [FramePose(1, zero, 2.0, (1.5, None)), FramePose(2, zero, 3.0, ()), FramePose(4, zero, None, (1, 1))]
    found = samples(gavrila, plots, [1, 2, 4], rows)
    np.testing.assert_array_equal(found, [[2, 3, np.nan], [1.5, np.nan, 1], [np.nan, np.nan, 1]])
