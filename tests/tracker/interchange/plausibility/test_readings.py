"""Points of simulated people in wrong names, axes, units and frames: named, or asked about, never taken in silence."""

import numpy as np
import pytest
from simulated_joints import N_FRAMES, SKELETONS, WRONG_M, Case, detected, skeleton_points

from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.trc import axes_matrix, axis_conventions, is_mirrored

SEEDS = [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 40))]


@pytest.fixture(scope="module", params=SEEDS)
def case(request):
    return Case(request.param)


def fields(found, key):
    return [p.remedy.fields[key] for p in found if key in p.remedy.fields]


@pytest.mark.slow
def test_true_points_raise_few_questions():
    """In space and in pictures, 200 people: at most 2 are asked about."""
    asked = []
    for seed in range(200):
        case = Case(seed)
        problems = case.found(case.points, in_space=seed % 2 == 0)
        asked += [(seed, str(f)) for f in problems[:1]]
    assert len(asked) <= 2, asked


def test_true_points_are_taken(case):
    assert case.found(case.points) == []


def test_other_axes_are_named(case):
    for words in case.rng.permutation([w for w in axis_conventions() if w != "x,y,z"])[:4]:
        assert words in fields(case.found(case.points @ axes_matrix(words)), "axes"), words
        problems = case.found(case.points @ axes_matrix(words), axes=str(words))
        assert problems == [] or (is_mirrored(words) and problems[0].remedy.code == "turn_axis")


class BesideAnother:
    """Silhouettes in which a person fits the place of another one better than their own, by mean truncated squares."""

    n_views, knows_frames = 4, False

    def __init__(self, own):
        self.own, self.certain = own, self

    def costs(self, places):
        (points,) = list(places.values())[:1]
        return np.where(points[:, 0] > 0, self.own, 0.0)

    def lag_errors_m(self, places, most):
        return []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("own", "is_everybody", "is_asked"), [(0.4, True, True), (0.4, False, False), (0.6, False, True)]
)
def test_another_ones_place_is_no_reason_to_turn_a_person_round(own, is_everybody, is_asked):
    case = Case(0)
    points = np.add(case.points, (5.0, 0.0, 0.0))
    problems = case.found(points, known_people=BesideAnother(own), is_everybody=is_everybody)
    assert fields(problems, "axes") == ["-x,-y,z"] * is_asked


@pytest.mark.parametrize(
    "factor",
    [1000.0, 0.3048, *(pytest.param(f, marks=pytest.mark.slow) for f in (100.0, 1 / 0.0254, 1 / 0.3048, 0.0254))],
)
def test_other_units_are_named(case, factor):
    problems = case.found(factor * case.points)
    assert "the points fit one of" in str(problems[0])
    assert f"times {1 / factor:.4g} the points fit" in str(problems[0])


@pytest.mark.parametrize("lag", [2, 5, -5])
def test_lags_are_named_where_they_matter(case, lag):
    """Points of other frames: a slow motion is near its place all the same."""
    late = np.full(case.points.shape, np.nan)
    inside = slice(max(lag, 0), N_FRAMES + min(lag, 0)), slice(max(-lag, 0), N_FRAMES + min(-lag, 0))
    late[inside[0]] = case.points[inside[1]]
    limbs = [case.skeleton.points.index(case.skeleton.markers[j]) for j in LIMB_JOINTS]
    moved = np.linalg.norm(case.clean[inside[0]] - case.clean[inside[1]], axis=-1)[:, limbs]
    problems = case.found(late)
    if moved.mean() > WRONG_M:
        assert problems, moved.mean()
    assert all(abs(frame + lag) <= 1 for frame in fields(problems, "frame")), problems


@pytest.mark.slow
def test_points_in_the_order_of_another_skeleton_are_refused(case):
    """Skeletons with as many points, or more of which the first are taken."""
    own = case.skeleton.counterparts(case.skeleton.points)
    for other in SKELETONS.values():
        first = other.points[: len(own)]
        theirs = other.counterparts(first)
        differ = [a for a, b in zip(own, first, strict=False) if own[a] and own[a] != theirs[b]]
        if len(first) < len(own) or not {own[a][0] for a in differ}.intersection(LIMB_JOINTS):
            continue
        problems = case.found(detected(skeleton_points(case.person, other), 0)[:, : len(own)])
        assert problems, other.name
        if len(other.points) == len(own):
            assert fields(problems, "name") == [other.name]


@pytest.mark.parametrize("in_space", [True, False])
def test_exchanged_sides_are_named(case, in_space):
    problems = case.found(case.points, skeleton=case.skeleton.with_sides_exchanged, in_space=in_space)
    assert "left for right" in str(problems[0])
