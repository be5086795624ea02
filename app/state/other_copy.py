"""Another copy of the open session, whose poses are compared with its own."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from tracker.body.model import PosedBody
    from tracker.geometry.arrays import Array

TOLERANCE_MM = 20.0
"""Largest distance of a joint at which two poses count as one, mm. Examiners place landmarks such as the greater
trochanter 15 to 20 mm apart (Della Croce et al. 1999; Rabuffetti et al. 2002)."""


class CopyDifference(NamedTuple):
    """How far two copies differ about a person on a frame that both annotated."""

    frame: int
    joint: str
    """Name of the joint that differs most."""
    distance_m: float


@dataclass(frozen=True, eq=False)
class OtherCopy:
    """The poses of another copy, and how far they differ."""

    name: str
    """Short name of its folder, by which it differs from that of the open session."""
    own_name: str
    """Short name of the folder of the open session."""
    poses: "tuple[Mapping[int, PosedBody], ...]"
    """By person: its poses by frame, each in the body that it was made with."""
    annotated: tuple[frozenset[int], ...]
    """By person: frames that its annotator set or verified."""
    differences: tuple[tuple[CopyDifference, ...], ...]
    """By person, ascending by frame."""
    tolerance_m: float
    """Distance of a joint up to which two poses count as one."""
    notes: tuple[str, ...] = ()
    """Sentences on what else differs: calibrations, bodies."""
    decided: "Mapping[tuple[int, int], Array]" = field(default_factory=dict)
    """By index of the person and frame: the own pose, (n_values,), with which the user has decided a difference. A pose
    that changes afterwards is no longer decided."""
