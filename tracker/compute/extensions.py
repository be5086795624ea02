"""Objects of other packages that extend this one, named by entry points.

A package adds an exporter, a metric, a layout of calibrations or a generator of starts by an entry point in its
`pyproject.toml`:

    [project.entry-points."quadrille.exporters"]
    amc = "my_package.amc:AMC"

The module that it names should import little, because help and menus load it. Groups and types of the objects:

| group | object |
|---|---|
| `quadrille.exporters` | `tracker.exports.export_format.ExportFormat` |
| `quadrille.metrics` | `tracker.evaluation.metric.Metric` |
| `quadrille.calibrations` | `tracker.calibrations.calibration_layout.CalibrationLayout` |
| `quadrille.starts` | `tracker.initialization.generators.start_generators.StartGenerator` |
"""

import logging
from collections.abc import Collection
from importlib import metadata
from typing import Any, NamedTuple

_LOG = logging.getLogger(__name__)
GROUPS = ("quadrille.exporters", "quadrille.metrics", "quadrille.calibrations", "quadrille.starts")
"""Groups of entry points that are read."""


class Extension(NamedTuple):
    """An entry point, and what became of it."""

    group: str
    name: str
    """By which the command line and the page refer to it."""
    package: str
    """Name and version of the package that has it."""
    value: Any
    """The object; None if it cannot be used."""
    error: str
    """Why it cannot be used; empty if it can."""


def extensions(group: str, kind: type | None = None, taken: Collection[str] = ()) -> list[Extension]:
    """Load the extensions of a group, in the order of their names. None of them raises: see `Extension.error`.

    Args:
        group: one of `GROUPS`.
        kind: type of the objects; None for functions.
        taken: names that extensions may not have.
    """
    found, names = list[Extension](), set(taken)
    for point in sorted(metadata.entry_points(group=group), key=lambda p: (p.name, p.value)):
        package = "" if point.dist is None else f"{point.dist.name} {point.dist.version}"
        value: Any = None
        error = ""
        if point.name in names:
            error = f"expected a name that is free, found '{point.name}' for the second time"
        else:
            try:
                value = point.load()
            except Exception as failure:  # whatever a stranger's module does
                error = f"{type(failure).__name__}: {failure}"
        if not error and not (callable(value) if kind is None else isinstance(value, kind)):
            wanted = "a function" if kind is None else f"a {kind.__name__}"
            value, error = None, f"expected {point.value} to be {wanted}, found a {type(value).__name__}"
        elif not error and getattr(value, "name", point.name) != point.name:
            value, error = None, f"expected the name '{value.name}' of {point.value}, found '{point.name}'"
        names.add(point.name)
        found.append(Extension(group, point.name, package, value, error))
    return found


def usable(group: str, kind: type | None = None, taken: Collection[str] = ()) -> dict[str, Any]:
    """Return the extensions of a group that can be used, by name; the log names the others with the reason.

    See `extensions`.
    """
    out = {}
    for each in extensions(group, kind, taken):
        if each.error:
            _LOG.warning("the extension '%s' of %s is left out: %s", each.name, each.package, each.error)
        else:
            out[each.name] = each.value
    return out
