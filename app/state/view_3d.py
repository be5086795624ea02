"""Content of the 3-D view, as one frozen value, and its form as a setting of the session."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Literal

from tracker.formats.model_toml import PRESETS

MAX_TRAIL_FRAMES = 250
"""Longest trail, frames to either side of the shown one."""


@dataclass(frozen=True)
class View3d:
    """The layers of the 3-D view."""

    bodies: bool = True
    """Whether the bodies are drawn."""
    colors: Literal["parts", "people"] = "people"
    """Whether bodies have the colours of parts or of people, as in the panes."""
    opacity: float = 1.0
    """Of the bodies, 0 to 1."""
    cameras: bool = True
    """Whether the cameras are drawn as frusta."""
    images: bool = True
    """Whether the frusta show the images of the shown frame."""
    floor: bool = True
    """Whether the grid on the floor is drawn."""
    gizmos: bool = True
    """Whether the handles that turn bodies and joints in space are drawn."""
    ghost: bool = False
    """Whether the predicted pose of the shown frame is drawn."""
    voxels: bool = False
    """Whether the voxels of the shown frame's silhouettes are drawn, in the colours of their parts."""
    character: str = ""
    """Name of the built-in body that moves as each person does, beside them; empty for none."""
    trail_points: frozenset[str] = frozenset()
    """Names of the points whose trails are drawn."""
    trail_frames: int = 25
    """Length of a trail, frames to either side of the shown one."""


def stored(view: View3d) -> dict[str, Any]:
    """Return a view as a JSON value; the inverse of `restored`."""
    return asdict(view) | {"trail_points": sorted(view.trail_points)}


def restored(data: object) -> View3d:
    """Return the view of a stored setting; missing and invalid fields have their defaults.

    Args:
        data: the result of `stored`, or any other JSON value.
    """
    default = View3d()
    if not isinstance(data, Mapping):
        return default
    are_switches = [f.name for f in fields(View3d) if isinstance(getattr(default, f.name), bool)]
    view = replace(default, **{name: data[name] for name in are_switches if isinstance(data.get(name), bool)})
    if data.get("colors") in ("parts", "people"):
        view = replace(view, colors=data["colors"])
    if data.get("character") in PRESETS:
        view = replace(view, character=data["character"])
    opacity, frames, points = data.get("opacity"), data.get("trail_frames"), data.get("trail_points")
    if isinstance(opacity, int | float) and 0 < opacity <= 1:
        view = replace(view, opacity=float(opacity))
    if isinstance(frames, int) and not isinstance(frames, bool) and 1 <= frames <= MAX_TRAIL_FRAMES:
        view = replace(view, trail_frames=frames)
    if isinstance(points, list) and all(isinstance(p, str) for p in points):
        view = replace(view, trail_points=frozenset(points))
    return view
