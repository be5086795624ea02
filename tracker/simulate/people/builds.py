"""The builds of simulated people: bones and flesh, which differ from person to person."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from tracker.body.model import BodyModel
from tracker.simulate.people.anatomy import Lobe, Point, lobes
from tracker.simulate.people.skeleton import BONE_FACTORS, Factors


@dataclass(frozen=True, eq=False)
class Build:
    """Bones and flesh of a kind of person, at any body height."""

    bone_factors: Mapping[str, Factors] = field(default_factory=lambda: BONE_FACTORS)
    """See `skeleton.BONE_FACTORS`."""
    girths: Mapping[str, float] = field(default_factory=dict)
    """Factor on the thickness of the flesh on each bone, left and right alike; 1 for bones left out."""
    further: tuple[Lobe, ...] = ()
    """Additional flesh and hair."""
    head_size: float = 1.0
    """Factor on the size of the head, of an adult's share of the body height."""

    def flesh(self, model: BodyModel) -> list[Lobe]:
        """List the lobes of a body of this build whose limbs have the model's lengths."""
        return [self._resized(lobe) for lobe in lobes(model)] + list(self.further)

    def _resized(self, lobe: Lobe) -> Lobe:
        if lobe.bone == "head":
            lobe = lobe._replace(start=_scaled(lobe.start, self.head_size), end=_scaled(lobe.end, self.head_size))
            lobe = lobe._replace(radii=(lobe.radii[0] * self.head_size, lobe.radii[1] * self.head_size))
        girth = self.girths.get(lobe.bone.removeprefix("left_").removeprefix("right_"), 1.0)
        return lobe._replace(radii=(lobe.radii[0] * girth, lobe.radii[1] * girth))


def _scaled(point: Point, factor: float) -> Point:
    x, y, z = point
    return factor * x, factor * y, factor * z


MAN = Build()

WOMAN = Build(
    # Bones of the man longer than the preset's are shorter here, and the other way round.
    bone_factors=MappingProxyType(
        {
            "neck": (1.0, 1.0, 0.95),
            "shoulder": (1.0, 0.92, 0.95),
            "elbow": (1.0, 1.0, 0.945),
            "wrist": (1.0, 1.0, 1.055),
            "hip": (1.0, 1.07, 1.055),
            "knee": (1.0, 1.0, 1.05),
            "ankle": (1.0, 1.0, 0.945),
            "head": (1.0, 1.0, 0.945),
        }
    ),
    girths=MappingProxyType({"torso": 0.95, "upper_arm": 0.88, "forearm": 0.90, "calf": 0.94}),
    further=(
        Lobe("torso", (0.044, 0.034, 0.082), (0.046, 0.034, 0.074), (0.031, 0.031)),
        Lobe("torso", (0.044, -0.034, 0.082), (0.046, -0.034, 0.074), (0.031, 0.031)),
        Lobe("torso", (-0.004, 0.048, -0.125), (-0.006, 0.050, -0.155), (0.050, 0.050)),  # hips
        Lobe("torso", (-0.004, -0.048, -0.125), (-0.006, -0.050, -0.155), (0.050, 0.050)),
        Lobe("head", (-0.060, 0, 0.096), (-0.066, 0, 0.088), (0.026, 0.024)),  # a knot of hair
    ),
)
