"""Origin of each point of a stored pose: how it was placed, by whom, when, and in which views."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from tracker.body.model import BodyModel
from tracker.interchange.exports.provenance import values_of_points
from tracker.session.store.records import SEEN, SOURCES, Pin, PoseRecord


class PointOrigin(NamedTuple):
    """Origin of a point of a pose."""

    source: str
    """The most manual source of the values that place it, one of `SOURCES`."""
    author: str
    """Author of the edit that gave it this source; empty for nobody named."""
    time: str
    """Time of this edit, ISO 8601, UTC."""
    views: tuple[str, ...]
    """Cameras in which a person put the point, or pinned it, by name."""


def point_origins(
    model: BodyModel, versions: Sequence[PoseRecord], pins: Sequence[Pin] = ()
) -> tuple[PointOrigin, ...]:
    """Return the origin of each point of the present pose, in the order of the body's `point_names`.

    An edit of one limb leaves the values of the others as they were. So the author of a point is that of the earliest
    version since which its most manual values and their source are unchanged.

    Args:
        model: the body of the present pose.
        versions: the present pose and those before it, the present one first; at least one.
        pins: of the person on the frame.
    """
    present = versions[0]
    seen: Mapping[str, Mapping[str, object]] = present.settings.get(SEEN, {})
    pinned: dict[str, set[str]] = {}
    for pin in pins:
        pinned.setdefault(pin.point, set()).add(pin.camera)
    out = []
    for name, values in zip(model.point_names, values_of_points(model), strict=True):
        source = min((present.sources[i] for i in values), key=SOURCES.index)
        made = _made(versions, [i for i in values if present.sources[i] == source])
        views = sorted({*seen.get(name, {}), *pinned.get(name, ())})
        out.append(PointOrigin(source, made.author, made.time, tuple(views)))
    return tuple(out)


def _made(versions: Sequence[PoseRecord], values: Sequence[int]) -> PoseRecord:
    """Return the earliest version since which some values, by index, and their sources are those of the first one."""
    present, made = versions[0], versions[0]
    for version in versions[1:]:
        if version.model_revision != present.model_revision or len(version.values) != len(present.values):
            break
        if any((version.values[i], version.sources[i]) != (present.values[i], present.sources[i]) for i in values):
            break
        made = version
    return made
