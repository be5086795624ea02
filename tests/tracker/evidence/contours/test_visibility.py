"""Lines of sight that a solid blocks, against walking along them."""

import numpy as np
import pytest

from tracker.evidence.contours.surfaces import surfaces_of
from tracker.evidence.contours.visibility import LANES, mark_occluded
from tracker.formats.model_toml import parse_model

PARTS = {
    "cone": 'shape = "cone", half_axes = [0.06, 0.1, 0.25], taper = 0.5',
    "cylinder": 'shape = "cone", half_axes = [0.06, 0.1, 0.25]',
    "ellipsoid": 'shape = "ellipsoid", half_axes = [0.1, 0.06, 0.2]',
    "limb": "half_axes = [0.05, 0.07, 0.2], exponents = [0.35, 1.0], taper = [0.22, 0.22]",
    "trunk": "half_axes = [0.12, 0.17, 0.31], exponents = [0.5, 0.8], taper = [0.0, 0.3]",
    "box": "half_axes = [0.1, 0.1, 0.1], exponents = [0.2, 0.2]",
}


def one_part(text):
    return parse_model(
        f"""
        version = 1
        name = "solid"
        height_m = 1.0
        parts = [{{ name = "solid", {text} }}]
        joints = [{{ name = "root", child = "solid", free = true }}]
        """,
        "solid",
    )


def blocked(model, points, eye, margin=0.0):
    """Result of `mark_occluded` for points in the part's frame."""
    surfaces = surfaces_of((model,))
    axes = surfaces.half_axes[0]
    Q = np.column_stack([np.diag(1 / axes), np.zeros(3), eye / axes]).astype(np.float32)
    out, room = np.zeros(len(points), bool), len(points) + LANES
    middles = np.pad(points.T, ((0, 0), (0, LANES))).astype(np.float32)
    mark_occluded(0, surfaces.solids, Q, margin, middles, 0, len(points), np.empty((2, room), np.float32), out)
    return out


def walked(shape, points, eye, first=0.0, n=201):
    """How deep the line of sight of each point gets: the least of the implicit function's root along it, (n,).

    In steps, then in eighty times finer ones around the deepest: along a line the function has one minimum.
    """
    s, step = np.linspace(first, 1, n, retstep=True)
    deepest = s[depths_along(shape, points, eye, s[:, None]).argmin(axis=0)]
    near = np.clip(deepest + step * np.linspace(-1, 1, 161)[:, None], first, 1)
    return depths_along(shape, points, eye, near).min(axis=0)


def depths_along(shape, points, eye, s):
    """The implicit function's root at parts of the way from points to the eye, (k, 1) or (k, n) to (k, n)."""
    return shape.inside_outside(points + s[..., None] * (eye - points)) ** (1 / shape.degree)


@pytest.mark.slow
@pytest.mark.parametrize("name", PARTS)
@pytest.mark.parametrize("eye", [(3.0, 0.5, 0.8), (0.3, 0.2, 2.5), (0.0, 0.0, 3.0), (2.0, 0.0, 0.0)])
def test_lines_of_sight_are_blocked_where_they_meet_the_solid(name, eye):
    model, eye = one_part(PARTS[name]), np.array(eye)
    rng = np.random.default_rng(2)
    points = rng.uniform(-2, 2, (3000, 3)) * model.shapes[0].half_axes
    depth = walked(model.shapes[0], points, eye)
    found = blocked(model, points, eye)
    exact = surfaces_of((model,)).solids[0, 4] > 0
    # What only grazes a superquadric (deepest at 0.9 of its size or more) may pass: its shape is asked at four places.
    assert np.all(found[depth < (0.995 if exact else 0.9)])
    assert not np.any(found[depth > 1.005])
    assert 50 < found.sum() < 2900
    assert np.mean(found == (depth < 1)) > 0.985


@pytest.mark.parametrize("name", PARTS)
def test_the_margin_reaches_behind_the_point(name):
    model, eye = one_part(PARTS[name]), np.array([3.0, 0.0, 0.0])
    before = np.array([[model.shapes[0].half_axes[0] + gap, 0.0, 0.0] for gap in (0.01, 0.05)])
    assert blocked(model, before, eye).tolist() == [False, False]
    assert blocked(model, before, eye, margin=0.03 / 3).tolist() == [True, False]


def test_hidden_panels_stay_hidden():
    model = one_part(PARTS["limb"])
    surfaces = surfaces_of((model,))
    Q = np.column_stack([np.eye(3), np.zeros(3), (50.0, 0, 0)]).astype(np.float32)
    out = np.array([True, False])
    mark_occluded(
        0, surfaces.solids, Q, 0.0, np.full((3, 2 + LANES), 9.0, np.float32), 0, 2, np.empty((2, 2 + LANES),
        np.float32), out,
    )  # fmt: skip
    assert out.tolist() == [True, False]
