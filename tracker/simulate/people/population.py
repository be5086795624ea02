"""People of other ages and statures than the adults of the scenes.

Builds are approximate, not read from tables. They aim at the proportions that these surveys describe. Children: R. G.
Snyder et al. 1977 (Anthropometry of infants, children, and youths to age 18, UM-HSRI-77-17). A child's head is up to
one and a half times as large a share of the stature as an adult's, and the legs make up for it. Adults: the tails of
ANSUR II (C. C. Gordon et al. 2014), and obese people in NHANES 2015-2018 (C. D. Fryar et al. 2021). Factors apply to
the skeleton of `gavrila22` and the flesh of `anatomy`.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from tracker.errors import TrackerError
from tracker.simulate.people.anatomy import Lobe
from tracker.simulate.people.builds import WOMAN, Build
from tracker.simulate.people.skeleton import Factors


class Individual(NamedTuple):
    """One person of a stature and a build."""

    height_m: float
    """Stature, metres."""
    build: Build


def _bones(legs: float, arms: float = 1.0, shoulders: float = 1.0, hips: float = 1.0, trunk: float = 1.0) -> dict[
    str, Factors
]:  # fmt: skip
    """Return bone factors; calf and forearm differ a little from what they are a share of."""
    return {
        "neck": (1.0, 1.0, trunk),
        "shoulder": (1.0, shoulders, trunk),
        "elbow": (1.0, 1.0, 1.02 * arms),
        "wrist": (1.0, 1.0, 0.98 * arms),
        "hip": (1.0, hips, trunk),
        "knee": (1.0, 1.0, 0.99 * legs),
        "ankle": (1.0, 1.0, 1.01 * legs),
    }


def _both_sides(*left: Lobe) -> tuple[Lobe, ...]:
    right = [
        lobe._replace(
            bone=lobe.bone.replace("left_", "right_"),
            start=(lobe.start[0], -lobe.start[1], lobe.start[2]),
            end=(lobe.end[0], -lobe.end[1], lobe.end[2]),
        )
        for lobe in left
    ]
    return (*left, *right)


_BELLY = Lobe("torso", (0.040, 0, -0.030), (0.045, 0, -0.085), (0.078, 0.080))
_SMALL_BELLY = Lobe("torso", (0.016, 0, -0.020), (0.018, 0, -0.070), (0.052, 0.052))
_BUST = _both_sides(Lobe("torso", (0.048, 0.038, 0.076), (0.050, 0.038, 0.066), (0.038, 0.038)))
_WIDE_HIPS = _both_sides(
    Lobe("torso", (-0.008, 0.058, -0.120), (-0.008, 0.060, -0.160), (0.064, 0.064)),
    Lobe("left_thigh", (0.0, 0.006, -0.02), (0.0, 0.002, -0.12), (0.060, 0.050)),
)
_FLANKS = _both_sides(Lobe("torso", (0.0, 0.056, -0.035), (0.0, 0.056, -0.085), (0.056, 0.056)))


def _individual(
    height_m: float,
    bones: Mapping[str, Factors],
    girths: Mapping[str, float],
    further: tuple[Lobe, ...] = (),
    head_size: float = 1.0,
) -> Individual:
    """Return a person of a stature, metres, and of a build."""
    return Individual(height_m, Build(bones, girths, further, head_size))


POPULATION: Mapping[str, Individual] = MappingProxyType(
    {
        "child_3": _individual(
            0.98,
            _bones(legs=0.857, arms=0.94, hips=0.92),
            {"upper_arm": 0.92, "forearm": 0.98, "thigh": 0.98},
            (_SMALL_BELLY,),
            head_size=1.42,
        ),
        "child_6": _individual(
            1.17,
            _bones(legs=0.896, arms=0.96, hips=0.90, shoulders=0.97),
            {"torso": 0.95, "upper_arm": 0.84, "forearm": 0.90, "thigh": 0.90, "calf": 0.94},
            head_size=1.28,
        ),
        "child_10": _individual(
            1.38,
            _bones(legs=0.943, arms=0.97, hips=0.93, shoulders=0.96),
            {"torso": 0.92, "upper_arm": 0.84, "forearm": 0.88, "thigh": 0.90, "calf": 0.93},
            head_size=1.13,
        ),
        "heavy_child": _individual(
            1.45,
            _bones(legs=0.945, arms=0.98, shoulders=0.97),
            {"torso": 1.10, "upper_arm": 1.10, "forearm": 1.05, "thigh": 1.12, "calf": 1.10},
            (_SMALL_BELLY, *_FLANKS),
            head_size=1.12,
        ),
        "heavy_man": _individual(
            1.76,
            _bones(legs=0.99, shoulders=1.03),
            {"torso": 1.15, "upper_arm": 1.25, "forearm": 1.15, "thigh": 1.18, "calf": 1.14, "head": 1.04},
            (_BELLY, *_FLANKS),
        ),
        "heavy_woman": _individual(
            1.62,
            _bones(legs=0.97, arms=0.97, shoulders=0.92, hips=1.10, trunk=1.03),
            {"torso": 1.10, "upper_arm": 1.20, "forearm": 1.05, "thigh": 1.22, "calf": 1.15},
            (_SMALL_BELLY, *_BUST, *_WIDE_HIPS, *_FLANKS),
        ),
        "short_woman": _individual(
            1.50, _bones(legs=0.96, arms=0.96, hips=1.08, trunk=1.03), WOMAN.girths, WOMAN.further, head_size=1.05
        ),
        "long_legged_woman": _individual(
            1.74,
            _bones(legs=1.05, arms=1.0, shoulders=0.93, hips=1.03, trunk=0.95),
            {"torso": 0.90, "upper_arm": 0.80, "forearm": 0.85, "thigh": 0.92, "calf": 0.90},
            WOMAN.further[:2],
            head_size=0.96,
        ),
        "tall_thin_man": _individual(
            1.97,
            _bones(legs=1.035, arms=1.04, shoulders=0.95, hips=0.90, trunk=0.98),
            {"torso": 0.86, "upper_arm": 0.82, "forearm": 0.88, "thigh": 0.84, "calf": 0.86},
            head_size=0.92,
        ),
        "broad_man": _individual(
            1.72,
            _bones(legs=0.95, arms=1.03, shoulders=1.12, hips=1.02, trunk=1.05),
            {"torso": 1.08, "upper_arm": 1.25, "forearm": 1.15, "thigh": 1.10, "calf": 1.08},
        ),
    }
)
"""People by name; a number in a name is an age in years."""


def individual(name: str) -> Individual:
    """Return a person.

    Raises:
        TrackerError: there is no such person.
    """
    if name not in POPULATION:
        raise TrackerError(f"expected one of the people {', '.join(POPULATION)}, found '{name}'")
    return POPULATION[name]
