"""Read, check and write body models as TOML files.

Positions and sizes are fractions of body height, angles are in degrees. A fitted model has a `height_m`, a preset has
none. See `tracker/body/models/gavrila22.toml` for an example.
"""

import fnmatch
import math
import os
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

import msgspec
import numpy as np
import tomli_w
from msgspec import Meta

from tracker.body.dimensions import HEIGHT_LIMITS_M
from tracker.body.model import BodyModel
from tracker.body.parts import Axis, Joint, Landmark, Part, SearchGroup
from tracker.errors import ModelError
from tracker.formats.text_files import DOCUMENT_BYTES, TextKind, packaged_texts, parse_toml, read_text
from tracker.geometry.arrays import TINY
from tracker.validation import UNPRINTABLE, Color, Name, Vector, check, check_version

VERSION = 1
"""Version of the files; a newer one is refused."""
DEFAULT_HEIGHT_M = 1.75
"""Height of an adult where none is given, metres."""
_PRESET_TEXTS = packaged_texts("body", "models")
PRESETS = tuple(_PRESET_TEXTS)


_KIND = TextKind("body model", DOCUMENT_BYTES, ModelError)

_LOWEST_M, _HIGHEST_M = HEIGHT_LIMITS_M
_Height: TypeAlias = Annotated[
    float, Meta(ge=_LOWEST_M, le=_HIGHEST_M, description=f"a height of {_LOWEST_M:g} to {_HIGHEST_M:g} metres")
]
_LARGEST = 10
"""Largest position and half-axis, fractions of the height."""
_WIDEST_TAPER = 0.9
"""Tapers are smaller: 1 is a point."""
_HALF_TURN_DEG = math.degrees(math.pi)
_Fraction: TypeAlias = Annotated[float, Meta(ge=-_LARGEST, le=_LARGEST)]
_Position: TypeAlias = Annotated[
    tuple[_Fraction, _Fraction, _Fraction], Meta(description="3 finite numbers, fractions of the height,")
]
_HalfAxis: TypeAlias = Annotated[float, Meta(ge=1e-4, le=_LARGEST)]
_Exponent: TypeAlias = Annotated[float, Meta(ge=0.05, le=1)]
_Taper: TypeAlias = Annotated[float, Meta(gt=-_WIDEST_TAPER, lt=_WIDEST_TAPER, description="a taper within 0.9")]
_TAPERS: dict[str, Any] = {
    "superquadric": Annotated[tuple[_Taper, _Taper], Meta(description="2 tapers within 0.9")],
    "cone": _Taper,
    "ellipsoid": Annotated[None, Meta(description="no taper of an ellipsoid")],
}
"""Type of the taper by shape. A union would be one declaration, but msgspec 0.22 crashes on it."""
_Parent: TypeAlias = Annotated[
    str,
    Meta(pattern=rf"^[^{UNPRINTABLE}]{{0,200}}\Z", description="the name of the parent part, or none for the root,"),
]
_Source: TypeAlias = Annotated[
    str, Meta(pattern=rf"^[^{UNPRINTABLE}]{{0,500}}\Z", description="a source of at most 500 characters,")
]
_Turn: TypeAlias = Annotated[float, Meta(ge=0, le=_HALF_TURN_DEG, description="an angle of 0 to 180 degrees")]


class _Row(msgspec.Struct, forbid_unknown_fields=True):
    """A table of a model file."""


class _AxisRow(_Row):
    name: Name
    axis: Vector
    limits_deg: Annotated[
        tuple[Annotated[float, Meta(le=0)], Annotated[float, Meta(ge=0)]],
        Meta(description="a lower limit up to 0 and an upper one from 0"),
    ] = (-np.inf, np.inf)
    spread_deg: Annotated[float, Meta(gt=0, description="a number above 0")] = np.inf

    def __post_init__(self) -> None:
        if np.linalg.norm(self.axis) < TINY:
            raise ValueError(f"expected a direction other than 0 as 'axis', found {list(self.axis)}")


class _CenteredRow(_Row, kw_only=True):
    """A table of a point with its joint centre."""

    center_offset: _Position = (0.0, 0.0, 0.0)
    center_source: _Source = ""

    def __post_init__(self) -> None:
        if any(self.center_offset) and not self.center_source:
            raise ValueError("expected the source of 'center_offset' as 'center_source', found none; name it")


class _JointRow(_CenteredRow):
    name: Name
    child: Name
    parent: _Parent = ""
    position: _Position = (0.0, 0.0, 0.0)
    kind: Literal["revolute", "ball"] = "revolute"
    axes: Annotated[list[_AxisRow], Meta(max_length=6, description="at most 6 axes")] = []
    free: bool = False
    cone_deg: _Turn = _HALF_TURN_DEG
    twist_deg: _Turn = _HALF_TURN_DEG

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.kind == "ball" and self.axes:
            raise ValueError(f"expected no axes of a ball joint, found {len(self.axes)}")


class _PartRow(_Row):
    name: Name
    half_axes: Annotated[
        tuple[_HalfAxis, _HalfAxis, _HalfAxis], Meta(description="3 half-axes above 0, fractions of the height,")
    ]
    shape: Literal["superquadric", "cone", "ellipsoid"] = "superquadric"
    exponents: Annotated[tuple[_Exponent, _Exponent], Meta(description="2 exponents of 0.05 to 1")] | None = None
    taper: Any = None
    """One of `_TAPERS`; 0 by default."""
    center: _Position = (0.0, 0.0, 0.0)
    color: Color = "#b0b0b0"

    def __post_init__(self) -> None:
        if self.exponents is not None and self.shape != "superquadric":
            raise ValueError(f"expected no exponents of the shape {self.shape}, found some; leave them out")


class _LandmarkRow(_CenteredRow):
    name: Name
    part: Name
    position: _Position


class _GroupRow(_Row):
    name: Name
    dofs: Annotated[list[Name], Meta(min_length=1, max_length=256, description="1 to 256 names")]


class _ModelFile(_Row):
    """A body model file."""

    name: Name
    joints: Annotated[list[_JointRow], Meta(min_length=1, max_length=128, description="1 to 128 joints")]
    parts: Annotated[list[_PartRow], Meta(min_length=1, max_length=128, description="1 to 128 parts")]
    version: int = VERSION
    height_m: _Height = DEFAULT_HEIGHT_M
    joint_sigma_m: Annotated[float, Meta(ge=0, le=1, description="0 to 1 metre")] | None = None
    height_sigma: Annotated[float, Meta(gt=0, le=1, description="a number above 0, at most 1")] | None = None
    landmarks: Annotated[list[_LandmarkRow], Meta(max_length=256, description="at most 256 landmarks")] = []
    search: Annotated[list[_GroupRow], Meta(max_length=32, description="at most 32 search groups")] = []


def load_model(name_or_path: str | Path, height_m: float | None = None) -> BodyModel:
    """Load a preset by name, or a model file by path.

    Args:
        name_or_path: `gavrila22`, or the path of a `.toml` file.
        height_m: body height, metres; by default the file's own, else 1.75.

    Raises:
        ModelError: the model is unknown, unreadable or malformed.
    """
    if str(name_or_path) in PRESETS:
        text = _PRESET_TEXTS[str(name_or_path)]
    else:
        path = Path(name_or_path)
        if path.suffix != ".toml" or not os.path.isfile(path):  # unlike pathlib's, for any name
            expected = f"one of {', '.join(PRESETS)} or the path of a .toml file"
            raise ModelError(f"body model '{name_or_path}' not found: expected {expected}")
        text = read_text(path, _KIND)
    return parse_model(text, str(name_or_path), height_m)


@lru_cache(maxsize=16)
def parse_model(text: str, source: str, height_m: float | None = None) -> BodyModel:
    """Parse and check a model's TOML text; `source` names it in messages. Cached: opening reads a model several times.

    Raises:
        ModelError: syntax, an unknown or missing key, a loop, a missing parent, impossible numbers.
    """
    where = f"body model {source}"
    data = parse_toml(text, source, _KIND)
    check_version(data, VERSION, where, ModelError)
    row: _ModelFile = check(data, _ModelFile, where, ModelError)
    height = check(row.height_m if height_m is None else height_m, _Height, where, ModelError)
    parts = {p.name: _part(p, where) for p in row.parts}
    children = [j.child for j in row.joints]
    if sorted(children) != sorted(p.name for p in row.parts):
        odd = set(children) ^ set(parts) or _doubles(children) | _doubles(p.name for p in row.parts)
        raise ModelError(f"{where}: expected exactly one joint for each part, but see: {', '.join(sorted(odd))}")
    joints = _order([_joint(j) for j in row.joints], source)
    landmarks = tuple(Landmark(m.name, m.part, m.position, m.center_offset, m.center_source) for m in row.landmarks)
    for m in landmarks:
        if m.part not in parts:
            raise ModelError(f"{where}: landmark '{m.name}' is on a missing part '{m.part}'")
    model = BodyModel(row.name, height, joints, tuple(parts[j.child] for j in joints), landmarks, ())
    for what, names in (("joint and landmark", model.point_names), ("degree of freedom", model.dof_names)):
        if doubles := _doubles(names):
            raise ModelError(f"{where}: expected each {what} once, found '{min(doubles)}' twice; rename one")
    groups = _search_groups(model, row.search, where)
    return replace(model, search_groups=groups, joint_sigma_m=row.joint_sigma_m, height_sigma=row.height_sigma)


def format_model(model: BodyModel) -> str:
    """Write a model with its height as TOML text. `parse_model` reads back the same model."""
    joints = []
    for j in model.joints:
        row: dict[str, Any] = {"name": j.name, "child": j.child, "position": list(j.position)}
        if j.parent:
            row["parent"] = j.parent
        if j.free:
            row["free"] = True
        if j.kind == "ball":
            row |= {"kind": "ball", "cone_deg": float(np.degrees(j.cone)), "twist_deg": float(np.degrees(j.twist))}
        if j.axes:
            row["axes"] = [
                {"name": a.name, "axis": list(a.direction), "limits_deg": [float(np.degrees(x)) for x in a.limits]}
                | ({"spread_deg": float(np.degrees(a.spread))} if np.isfinite(a.spread) else {})
                for a in j.axes
            ]
        joints.append(row | _center_row(j))
    parts = [_part_row(p) for p in model.parts]
    landmarks = [
        {"name": m.name, "part": m.part, "position": list(m.position)} | _center_row(m) for m in model.landmarks
    ]
    search = [{"name": g.name, "dofs": list(g.dofs)} for g in model.search_groups]
    # Only where it is known, so that older programs read other files.
    sigmas = {"joint_sigma_m": model.joint_sigma_m, "height_sigma": model.height_sigma}
    return tomli_w.dumps(
        {
            "version": VERSION,
            "name": model.name,
            "height_m": model.height_m,
            **{name: sigma for name, sigma in sigmas.items() if sigma is not None},
            "search": search,
            "joints": joints,
            "landmarks": landmarks,
            "parts": parts,
        }
    )


def _center_row(point: Joint | Landmark) -> dict[str, Any]:
    """Return the keys of a joint centre; none where it is the point itself, so that older programs read the file."""
    if not any(point.center_offset):
        return {}
    return {"center_offset": list(point.center_offset), "center_source": point.center_source}


def _part_row(p: Part) -> dict[str, Any]:
    row: dict[str, Any] = {"name": p.name, "half_axes": list(p.half_axes)}
    if p.kind == "superquadric":
        row |= {"exponents": list(p.exponents), "taper": list(p.taper)}
    else:
        row |= {"shape": p.kind} | ({"taper": p.taper[0]} if p.kind == "cone" else {})
    return row | {"center": list(p.center), "color": p.color}


def _joint(row: _JointRow) -> Joint:
    axes = []
    for a in row.axes:
        x, y, z = np.array(a.axis) / np.linalg.norm(a.axis)
        low, high = (float(np.radians(v)) for v in a.limits_deg)
        axes.append(Axis(a.name, (float(x), float(y), float(z)), (low, high), float(np.radians(a.spread_deg))))
    cone, twist = float(np.radians(row.cone_deg)), float(np.radians(row.twist_deg))
    return Joint(
        row.name, row.parent, row.child, row.position, row.kind, tuple(axes), row.free, cone, twist,
        row.center_offset, row.center_source,
    )  # fmt: skip


def _part(row: _PartRow, where: str) -> Part:
    taper = (0.0, 0.0)
    if row.taper is not None:
        taper = check(row.taper, _TAPERS[row.shape], f"{where}, taper of part '{row.name}'", ModelError)
        taper = (taper, taper) if row.shape == "cone" else taper
    return Part(row.name, row.half_axes, row.exponents or (1.0, 1.0), taper, row.center, row.color, row.shape)


def _doubles(names: Iterable[str]) -> set[str]:
    return {name for name, count in Counter(names).items() if count > 1}


def _order(joints: Sequence[Joint], source: str) -> tuple[Joint, ...]:
    """Check that the joints form one tree, and sort them parent first."""
    parts = {j.child for j in joints}
    roots = [j.name for j in joints if not j.parent]
    for j in joints:
        if j.parent and j.parent not in parts:
            problem = f"joint '{j.name}' hangs on a missing parent part '{j.parent}'"
            raise ModelError(f"body model {source}: {problem}; expected one of {', '.join(sorted(parts))}")
    placed: dict[str, Joint] = {}
    waiting = list(joints)
    while waiting:
        # Place only the first ready joint: a file that is parent first keeps its order.
        ready = next((j for j in waiting if not j.parent or j.parent in placed), None)
        if ready is None:
            names = ", ".join(j.name for j in waiting)
            raise ModelError(f"body model {source}: the joints {names} form a loop; each needs a way to the root")
        placed[ready.child] = ready
        waiting.remove(ready)
    if len(roots) != 1:
        raise ModelError(f"body model {source}: expected one joint without a parent, found {roots}")
    return tuple(placed.values())


def _search_groups(model: BodyModel, groups: Sequence[_GroupRow], where: str) -> tuple[SearchGroup, ...]:
    """Expand `joint.*` patterns; without any group, one group has all degrees of freedom."""
    if not groups:
        return (SearchGroup("whole body", model.dof_names),)
    out = []
    for group in groups:
        dofs: list[str] = []
        for pattern in group.dofs:
            found = [pattern] if pattern in model.dof_names else fnmatch.filter(model.dof_names, pattern)
            if not found:
                raise ModelError(f"{where}: search group '{group.name}' names an unknown dof '{pattern}'; correct it")
            dofs += found
        if doubles := _doubles(dofs):
            raise ModelError(f"{where}: search group '{group.name}' names '{min(doubles)}' twice; leave one out")
        out.append(SearchGroup(group.name, tuple(dofs)))
    return tuple(out)


def has_preset_sizes(model: BodyModel) -> bool:
    """Return whether a body still has all sizes of its preset, so that the height of the person is not known."""
    return model.name in PRESETS and format_model(model) == format_model(load_model(model.name))


def has_preset_proportions(model: BodyModel) -> bool:
    """Return whether a body has the sizes of its preset but for its height, so that they are nobody's own."""
    return model.name in PRESETS and has_preset_sizes(
        replace(model, height_m=load_model(model.name).height_m, height_sigma=None)
    )
