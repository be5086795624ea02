"""Read, check and write body models as TOML files.

Positions and sizes are fractions of body height, angles are in degrees. A fitted model has a `height_m`, a preset has
none. See `tracker/body/models/gavrila22.toml` for an example.
"""

from fnmatch import fnmatchcase
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from tracker.body.model import BodyModel
from tracker.body.parts import Axis, Joint, Landmark, Part, SearchGroup
from tracker.errors import ModelError
from tracker.files import parse_toml

VERSION = 1
DEFAULT_HEIGHT_M = 1.75
PRESETS = tuple(
    sorted(f.name[:-5] for f in (resources.files("tracker") / "body" / "models").iterdir() if f.name.endswith(".toml"))
)


def load_model(name_or_path: str | Path, height_m: float | None = None) -> BodyModel:
    """Load a preset by name, or a model file by path.

    Args:
        name_or_path: `gavrila22`, or the path of a `.toml` file.
        height_m: body height, metres; by default the file's own, else 1.75.

    Raises:
        ModelError: the model is unknown, unreadable or malformed.
    """
    if str(name_or_path) in PRESETS:
        text = (resources.files("tracker") / "body" / "models" / f"{name_or_path}.toml").read_text("utf-8")
    else:
        path = Path(name_or_path)
        if path.suffix != ".toml" or not path.is_file():
            raise ModelError(
                f"body model '{name_or_path}' not found: expected one of {', '.join(PRESETS)} "
                "or the path of a .toml file"
            )
        text = path.read_text("utf-8")
    return parse_model(text, str(name_or_path), height_m)


def parse_model(text: str, source: str, height_m: float | None = None) -> BodyModel:
    """Parse and check a model's TOML text; `source` names it in messages.

    Raises:
        ModelError: syntax, an unknown or missing key, a loop, a missing parent, impossible numbers.
    """
    data = parse_toml(text, f"body model {source}", ModelError)
    if int(data.get("version", 0)) > VERSION:
        raise ModelError(
            f"body model {source} has version {data['version']}, this program reads up to {VERSION}; upgrade quadrille"
        )
    try:
        height = float(height_m if height_m is not None else data.get("height_m", DEFAULT_HEIGHT_M))
        listed = tuple(_joint(j, source) for j in data["joints"])
        parts = {p["name"]: _part(p, source) for p in data["parts"]}
        landmarks = tuple(
            Landmark(m["name"], m["part"], _numbers(m["position"], 3, source, m["name"]))
            for m in data.get("landmarks", [])
        )
        groups = [(g["name"], list(g["dofs"])) for g in data.get("search", [])]
        name = str(data["name"])
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        what = f"the key {error} is missing" if isinstance(error, KeyError) else str(error)
        raise ModelError(
            f"body model {source} is malformed: {what}; compare it with tracker/body/models/gavrila22.toml"
        ) from error
    if not 0.3 <= height <= 3.0:
        raise ModelError(f"body model {source}: expected a height of 0.3 to 3 metres, found {height:g}")
    listed_children = [j.child for j in listed]
    if sorted(listed_children) != sorted(parts):
        odd = sorted(set(listed_children) ^ set(parts)) or sorted(
            {c for c in listed_children if listed_children.count(c) > 1}
        )
        raise ModelError(f"body model {source}: expected exactly one joint for each part, but see: {', '.join(odd)}")
    joints = _order(listed, source)
    children = [j.child for j in joints]
    for m in landmarks:
        if m.part not in parts:
            raise ModelError(f"body model {source}: landmark '{m.name}' is on a missing part '{m.part}'")
    model = BodyModel(name, height, joints, tuple(parts[c] for c in children), landmarks, ())
    return BodyModel(name, height, joints, model.parts, landmarks, _search_groups(model, groups, source))


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
            row |= {
                "kind": "ball",
                "cone_deg": float(np.degrees(j.cone)),
                "twist_deg": float(np.degrees(j.twist)),
            }
        if j.axes:
            row["axes"] = [
                {
                    "name": a.name,
                    "axis": list(a.direction),
                    "limits_deg": [float(np.degrees(x)) for x in a.limits],
                }
                | ({"spread_deg": float(np.degrees(a.spread))} if np.isfinite(a.spread) else {})
                for a in j.axes
            ]
        joints.append(row)
    parts = [_part_row(p) for p in model.parts]
    landmarks = [{"name": m.name, "part": m.part, "position": list(m.position)} for m in model.landmarks]
    search = [{"name": g.name, "dofs": list(g.dofs)} for g in model.search_groups]
    return tomli_w.dumps(
        {
            "version": VERSION,
            "name": model.name,
            "height_m": model.height_m,
            "search": search,
            "joints": joints,
            "landmarks": landmarks,
            "parts": parts,
        }
    )


def _part_row(p: Part) -> dict[str, Any]:
    row: dict[str, Any] = {"name": p.name, "half_axes": list(p.half_axes)}
    if p.kind == "superquadric":
        row |= {"exponents": list(p.exponents), "taper": list(p.taper)}
    else:
        row |= {"shape": p.kind} | ({"taper": p.taper[0]} if p.kind == "cone" else {})
    return row | {"center": list(p.center), "color": p.color}


def _numbers(value: Any, count: int, source: str, where: str) -> Any:
    numbers = tuple(float(v) for v in value)
    if len(numbers) != count or not np.all(np.isfinite(numbers)):
        raise ModelError(f"body model {source}: '{where}' expected {count} finite numbers, found {value}")
    return numbers


def _axis(data: Any, source: str, joint: str) -> Axis:
    direction = np.array(_numbers(data["axis"], 3, source, f"{joint}.{data['name']}"))
    low, high = (float(np.radians(float(v))) for v in data.get("limits_deg", (-np.inf, np.inf)))
    spread = float(np.radians(float(data.get("spread_deg", np.inf))))
    norm = float(np.linalg.norm(direction))
    if not spread > 0.0:
        raise ModelError(
            f"body model {source}: axis '{joint}.{data['name']}' expected a spread_deg above 0, "
            f"found {data['spread_deg']}"
        )
    if norm < 1e-9 or not low <= 0.0 <= high:
        raise ModelError(
            f"body model {source}: axis '{joint}.{data['name']}' expected a direction and limits around 0, "
            f"found {data['axis']} and {data.get('limits_deg')}"
        )
    x, y, z = direction / norm
    return Axis(str(data["name"]), (float(x), float(y), float(z)), (low, high), spread)


def _joint(data: Any, source: str) -> Joint:
    name, kind = str(data["name"]), data.get("kind", "revolute")
    if kind not in ("revolute", "ball"):
        raise ModelError(f"body model {source}: joint '{name}' expected kind revolute or ball, found '{kind}'")
    return Joint(
        name,
        str(data.get("parent", "")),
        str(data["child"]),
        _numbers(data.get("position", (0, 0, 0)), 3, source, name),
        kind,
        tuple(_axis(a, source, name) for a in data.get("axes", [])),
        bool(data.get("free", False)),
        float(np.radians(data.get("cone_deg", 180.0))),
        float(np.radians(data.get("twist_deg", 180.0))),
    )


def _part(data: Any, source: str) -> Part:
    name, kind = str(data["name"]), data.get("shape", "superquadric")
    if kind not in ("superquadric", "cone", "ellipsoid"):
        raise ModelError(
            f"body model {source}: part '{name}' expected shape superquadric, cone or ellipsoid, found '{kind}'"
        )
    unknown = {"superquadric": set(), "cone": {"exponents"}, "ellipsoid": {"exponents", "taper"}}[kind] & set(data)
    if unknown:
        raise ModelError(
            f"body model {source}: part '{name}' is of shape {kind}, which has no {' and no '.join(sorted(unknown))}; "
            "leave it out"
        )
    half_axes = _numbers(data["half_axes"], 3, source, name)
    exponents = _numbers(data.get("exponents", (1, 1)), 2, source, name)
    taper = [data.get("taper", 0)] * 2 if kind == "cone" else data.get("taper", (0, 0))
    taper = _numbers(taper, 2, source, name)
    if min(half_axes) <= 0 or not all(0.05 <= e <= 1 for e in exponents) or not all(abs(k) < 0.9 for k in taper):
        raise ModelError(
            f"body model {source}: part '{name}' expected half-axes above 0, exponents of 0.05 to 1 and tapers within "
            f"0.9, found {half_axes}, {exponents}, {taper}"
        )
    center = _numbers(data.get("center", (0, 0, 0)), 3, source, name)
    return Part(name, half_axes, exponents, taper, center, str(data.get("color", "#b0b0b0")), kind)


def _order(joints: tuple[Joint, ...], source: str) -> tuple[Joint, ...]:
    """Check that the joints form one tree, and sort them parent first."""
    parts = {j.child for j in joints}
    roots = [j.name for j in joints if not j.parent]
    for j in joints:
        if j.parent and j.parent not in parts:
            raise ModelError(
                f"body model {source}: joint '{j.name}' hangs on a missing parent part '{j.parent}'; "
                f"expected one of {', '.join(sorted(parts))}"
            )
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


def _search_groups(model: BodyModel, groups: list[tuple[str, list[str]]], source: str) -> tuple[SearchGroup, ...]:
    """Expand `joint.*` patterns; without any group, one group has all degrees of freedom."""
    if not groups:
        return (SearchGroup("whole body", model.dof_names),)
    out = []
    for name, patterns in groups:
        dofs = []
        for pattern in patterns:
            found = [d for d in model.dof_names if fnmatchcase(d, pattern)]
            if not found:
                raise ModelError(f"body model {source}: search group '{name}' names an unknown dof '{pattern}'")
            dofs += found
        out.append(SearchGroup(name, tuple(dofs)))
    return tuple(out)
