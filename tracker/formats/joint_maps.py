"""Map the markers of a foreign file to the joints of the body.

The project's own names are those of `BodyModel.point_names`: `left_shoulder`, `left_wrist`, `neck`, ... The conventions
of other programs are the files of `tracker/formats/skeletons`, in the layout of a user's own joint map.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import msgspec

from tracker.errors import FormatError, Remedy
from tracker.formats.text_files import DOCUMENT_BYTES, TextKind, packaged_texts, parse_toml, read_toml
from tracker.formats.trc import MarkerTable
from tracker.validation import Name, check

LIMB_JOINTS = tuple(
    f"{side}_{j}" for side in ("left", "right") for j in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
)
"""The joints over which errors are averaged."""
JOINTS = (*LIMB_JOINTS, "neck", "head")
FOOT_POINTS = tuple(f"{side}_{point}" for side in ("left", "right") for point in ("heel", "toe"))
"""Points of the feet, which some bodies have."""
_BODY_POINTS = (*JOINTS, *FOOT_POINTS)

_KIND = TextKind("joint map", DOCUMENT_BYTES, FormatError)
_JointMapFile = msgspec.defstruct(
    "_JointMapFile",
    [
        *((point, Name | None, None) for point in _BODY_POINTS),
        ("points", tuple[Name, ...], ()),
        ("means", dict[Name, tuple[Name, ...]], msgspec.field(default_factory=dict)),
    ],
    forbid_unknown_fields=True,
)
"""A joint map file: the name of a marker for each joint that the file has; see `JointMap` for the rest."""


@dataclass(frozen=True)
class JointMap:
    """A naming convention."""

    name: str
    markers: Mapping[str, str]
    """Name of the marker for each joint or point of the body that the convention knows."""
    means: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Points of the body whose mean a marker is, by marker, such as the middle of the hips."""
    points: tuple[str, ...] = ()
    """Markers in the order of files that name none; empty if unknown."""

    def counterparts(self, markers: Sequence[str]) -> dict[str, tuple[str, ...]]:
        """Return the points of the body whose mean each marker is, by marker; empty for one without a counterpart."""
        single = {marker: (point,) for point, marker in self.markers.items()}
        return {m: single.get(m) or tuple(self.means.get(m, ())) for m in markers}

    def missing(self, names: Sequence[str], lacks: str) -> list[FormatError]:
        """Return that the first marker which is not among some names is missing; `lacks` begins the sentence."""
        listed = f"which the joint map {self.name} names; expected one of {', '.join(names)}"
        return [FormatError(f"{lacks} '{m}', {listed}") for m in self.markers.values() if m not in names][:1]

    @property
    def with_sides_exchanged(self) -> "JointMap":
        """The convention with left for right."""
        return replace(
            self,
            name=f"{self.name} with left and right exchanged",
            markers={_other_side(point): marker for point, marker in self.markers.items()},
            means={marker: tuple(map(_other_side, points)) for marker, points in self.means.items()},
        )


def _other_side(point: str) -> str:
    side, _, joint = point.partition("_")
    return f"{'right' if side == 'left' else 'left'}_{joint}" if joint else point


OWN = JointMap("our own", {j: j for j in _BODY_POINTS})


@cache
def known_joint_maps() -> tuple[JointMap, ...]:
    """Return the conventions that the program knows."""
    texts = packaged_texts("formats", "skeletons")
    return (OWN, *(parse_joint_map(name, parse_toml(text, name, _KIND), name) for name, text in texts.items()))


_MIN_JOINTS = 4
"""Fewest limb joints under the names of a convention by which a file follows it."""


def guess_joint_map(markers: Sequence[str], source: str) -> JointMap:
    """Guess the naming convention of a file from its markers; `source` names the file in messages.

    It is the one under whose names the file has most limb joints, and among those most points of any kind.

    Raises:
        FormatError: the markers follow no known convention.
    """

    def fit(known: JointMap) -> tuple[int, int]:
        names = {*known.markers.values(), *known.points, *known.means}
        return sum(known.markers.get(j) in markers for j in LIMB_JOINTS), len(names.intersection(markers))

    best = max(known_joint_maps(), key=fit)
    if fit(best)[0] < _MIN_JOINTS:
        known = f"follow no known convention ({', '.join(m.name for m in known_joint_maps())})"
        found = f"{', '.join(markers[:8])}{', ...' if len(markers) > 8 else ''}"
        remedy = Remedy("give_joint_map", marker=json.dumps(markers[0], ensure_ascii=False))
        raise FormatError(f"the markers of {source} {known}: found {found}", remedy)
    return best


def joint_maps_of_size(n_points: int) -> tuple[JointMap, ...]:
    """Return the known conventions with a number of points; by name, which puts the more common one first."""
    return tuple(known for known in known_joint_maps() if len(known.points) == n_points)


def joint_map_of_size(n_points: int, source: str) -> JointMap:
    """Return the known convention of a file that names no points, by their number; the first of several.

    Raises:
        FormatError: no convention has so many points.
    """
    if found := joint_maps_of_size(n_points):
        return found[0]
    sizes = ", ".join(f"{len(m.points)} ({m.name})" for m in known_joint_maps() if m.points)
    expected = f"the number of points of a known skeleton, {sizes}"
    raise FormatError.mismatch(source, expected, n_points, Remedy("give_point_order", n=n_points))


def read_joint_map(path: str | Path) -> JointMap:
    """Return a known convention by its name, or read one from TOML: one line `left_shoulder = "LSHO"` for each joint.

    `points = ["LSHO", ...]` lists the markers of files without names, in order. `[means]` has a line
    `MidHip = ["left_hip", "right_hip"]` for each marker that is a mean.

    Raises:
        FormatError: the file is missing or malformed, or names an unknown joint.
    """
    for known in known_joint_maps():
        if known.name == str(path) and not Path(path).exists():
            return known
    return parse_joint_map(Path(path).name, read_toml(Path(path), _KIND), str(path))


def format_joint_map(joint_map: JointMap) -> dict[str, object]:
    """Return the content of the file from which `read_joint_map` reads a convention."""
    out: dict[str, object] = {"points": list(joint_map.points)} if joint_map.points else {}
    means = {marker: list(points) for marker, points in joint_map.means.items()}
    return out | dict(joint_map.markers) | ({"means": means} if means else {})


def parse_joint_map(name: str, data: object, source: str) -> JointMap:
    """Return the convention of a file's content; `source` names it in messages. Raises as `read_joint_map` does."""
    found = msgspec.to_builtins(check(data, _JointMapFile, f"joint map {source}", FormatError))
    markers = {p: found[p] for p in _BODY_POINTS if found[p] is not None}
    if not markers:
        expected = f'lines such as left_shoulder = "LSHO" for {", ".join(JOINTS)}'
        raise FormatError.mismatch(f"joint map {source}", expected, "none", "add them")
    means = {marker: tuple(points) for marker, points in found["means"].items()}
    for marker, points in means.items():
        if unknown := [p for p in points if p not in _BODY_POINTS] or (["nothing"] if not points else []):
            expected = f"'{marker}' to be a mean of {', '.join(_BODY_POINTS)}"
            raise FormatError.mismatch(f"joint map {source}", expected, unknown[0], "correct it")
    points = tuple(found["points"])
    if len(set(points)) < len(points):
        raise FormatError(f"joint map {source}: expected each of 'points' once, found one twice; correct it")
    return JointMap(name, markers, means, points)


def joints_of(table: MarkerTable, source: str, joint_map: JointMap | None = None) -> MarkerTable:
    """Select the body's joints of a file, under the project's names, in the order of `JOINTS`.

    Args:
        table: the file's markers.
        source: names the file in messages.
        joint_map: its naming convention; guessed by default.

    Raises:
        FormatError: no convention fits, or the map names a marker that the file lacks.
    """
    for error in joint_map.missing(table.names, f"{source} has no marker") if joint_map else ():
        raise error
    markers = (joint_map or guess_joint_map(table.names, source)).markers
    markers = {j: m for j, m in markers.items() if m in table.names}
    joints = tuple(j for j in JOINTS if j in markers)
    columns = [table.names.index(markers[j]) for j in joints]
    return replace(table, names=joints, points=table.points[:, columns])
