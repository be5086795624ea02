"""Objects of other packages that extend this one, named by entry points.

A package adds an exporter, a metric, a layout of calibrations or a generator of starts by an entry point in its
`pyproject.toml`:

    [project.entry-points."quadrille.exporters"]
    amc = "my_package.amc:AMC"

The module that it names should import little, because help and menus load it. Groups and types of the objects:

| group | object |
|---|---|
| `quadrille.exporters` | `tracker.interchange.exports.formats.ExportFormat` |
| `quadrille.metrics` | `tracker.evaluation.metric.Metric` |
| `quadrille.calibrations` | `tracker.formats.calibrations.calibration_layout.CalibrationLayout` |
| `quadrille.detectors` | `tracker.interchange.detection.detector.DetectorKind` |
| `quadrille.starts` | `tracker.estimation.initialization.generators.start_generators.StartGenerator` |
"""

import io
import logging
import os
import sys
import threading
from collections.abc import Collection, Generator, Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from functools import cache, cached_property
from importlib import metadata
from textwrap import shorten
from typing import Any, NamedTuple, TypeVar

T = TypeVar("T")

_LOG = logging.getLogger(__name__)
_OWN_POINTS = metadata.Distribution.__dict__["entry_points"]
_UNREAD: dict[str, str] = {}
_LOCK = threading.Lock()  # one is loaded at a time: output is redirected for all threads
GROUPS = (
    "quadrille.exporters",
    "quadrille.metrics",
    "quadrille.calibrations",
    "quadrille.detectors",
    "quadrille.starts",
)
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
    """Why it cannot be used, in one line; empty if it can."""
    printed: str = ""
    """Text that its module wrote while it was loaded, in one line."""


def extensions(
    group: str, kind: type | None = None, taken: Collection[str] = (), name: str | None = None
) -> list[Extension]:
    """Load the extensions of a group, in the order of their names. None of them raises: see `Extension.error`.

    Args:
        group: one of `GROUPS`.
        kind: type of the objects; None for functions.
        taken: names that extensions may not have.
        name: of the only one to load; None for all.
    """
    found, names = list[Extension](), set(taken)
    for package, point in _installed():
        if point.group != group or name not in (None, point.name):
            continue
        if point.name in names:
            error = f"expected a name that is free, found '{point.name}' for the second time"
            found.append(Extension(group, point.name, package, None, error))
        else:
            loading = _Loading(point, kind)
            found.append(Extension(group, point.name, package, *loading.outcome(), loading.printed()))
        names.add(point.name)
    return found


def usable(
    group: str, kind: type | None = None, taken: Collection[str] = (), name: str | None = None
) -> dict[str, Any]:
    """Return the extensions of a group that can be used, by name; the log names the others with the reason.

    See `extensions`.
    """
    out = {}
    for each in extensions(group, kind, taken, name):
        if each.error:
            _LOG.warning("the extension '%s' of %s is left out: %s", each.name, each.package, each.error)
        else:
            out[each.name] = each.value
    return out


def unread_packages() -> dict[str, str]:
    """Return the packages, of whatever kind, whose entry points cannot be read, with the reason."""
    _installed()
    return _UNREAD


def pass_over_unread_packages() -> None:
    """Let all libraries of this process pass over packages whose entry points cannot be read.

    One broken package would end any program that looks for entry points, as typeguard and Numba do.
    """
    setattr(metadata.Distribution, "entry_points", property(_points))  # noqa: B010


class Extended(Mapping[str, T]):
    """Objects of this program by name, and behind them the extensions, loaded once nothing before them is meant."""

    def __init__(self, own: Mapping[str, T], group: str, kind: type | None = None) -> None:
        """Load nothing yet.

        Args:
            own: objects of this program; no extension takes the place of one.
            group: of the extensions.
            kind: type of the objects; None for functions.
        """
        self.own, self._group, self._kind = own, group, kind
        self._asked: dict[str, dict[str, T]] = {}

    @cached_property
    def added(self) -> dict[str, T]:
        """The extensions that can be used, by name."""
        return usable(self._group, self._kind, self.own)

    def __getitem__(self, name: str) -> T:
        """Return the object of a name; no other extension is loaded for it."""
        if name in self.own:
            return self.own[name]
        if name not in self._asked:
            self._asked[name] = usable(self._group, self._kind, self.own, name)
        return self._asked[name][name]

    def __iter__(self) -> Iterator[str]:
        """Yield the names, own ones first."""
        yield from self.own
        yield from self.added

    def __len__(self) -> int:
        """Return the number of objects."""
        return len(self.own) + len(self.added)


class _Loading(threading.Thread):
    """Loads an entry point. The module is a stranger's: it may wait, print, and ask to end the program."""

    LIMIT_S = 10.0
    """Time until it is given up; it should import little."""

    def __init__(self, point: metadata.EntryPoint, kind: type | None) -> None:
        super().__init__(daemon=True, name=f"extension {point.name}")
        self._point, self._kind = point, kind
        self._value: Any = None
        self._error = f"expected a module that is loaded within {self.LIMIT_S:g} s, found one that takes longer"

    def outcome(self) -> tuple[Any, str]:
        """Return the object, and why it cannot be used."""
        with _LOCK:
            self._out = _OwnThreadOutput(self, sys.stdout)
            with _no_direct_output(), redirect_stdout(self._out):
                self.start()
                self.join(self.LIMIT_S)
            if self.is_alive():
                sys.stdout = self._out  # what it prints later belongs into no output either
        return (None, self._error) if self._error else (self._value, "")

    def printed(self) -> str:
        """Return what it has printed, in one line."""
        return _one_line(self._out.text.getvalue())

    def run(self) -> None:
        """Load and check the object."""
        try:
            value = self._point.load()
            self._error = self._fault(value)
            self._value = value
        except BaseException as failure:  # SystemExit and KeyboardInterrupt, too: whatever a stranger's module does
            self._error = _described(failure)

    def _fault(self, value: Any) -> str:
        if not (callable(value) if self._kind is None else isinstance(value, self._kind)):
            wanted = "a function" if self._kind is None else f"a {self._kind.__name__}"
            return f"expected {self._point.value} to be {wanted}, found a {type(value).__name__}"
        name = getattr(value, "name", self._point.name)
        if name != self._point.name:
            return _one_line(f"expected the name '{name}' of {self._point.value}, found '{self._point.name}'")
        return ""


@contextmanager
def _no_direct_output() -> Generator[None, None, None]:
    """Send to standard error what is written to file 1 beside `sys.stdout`, as C libraries and child programs do."""
    standard = sys.__stdout__
    try:
        kept = os.dup(1)
    except OSError:  # a service without standard output
        yield
        return
    try:
        if standard is not None:
            standard.flush()
        os.dup2(2, 1)
        yield
        if standard is not None:
            standard.flush()
    finally:
        os.dup2(kept, 1)
        os.close(kept)


class _OwnThreadOutput:
    """Standard output without that of one thread, which is kept."""

    def __init__(self, thread: threading.Thread, out: Any) -> None:
        self._thread, self._out = thread, out
        self.text = io.StringIO()

    def write(self, text: str) -> int:
        """Write a text, or keep it."""
        return int((self.text if threading.current_thread() is self._thread else self._out).write(text))

    def flush(self) -> None:
        """Flush the output of the others."""
        self._out.flush()

    def close(self) -> None:
        """Leave the output open: it is the program's."""

    def __getattr__(self, name: str) -> Any:
        """Return whatever else the output has."""
        return getattr(self._out, name)


@cache
def _installed() -> list[tuple[str, metadata.EntryPoint]]:
    """Return the entry points of our groups with their packages, by name."""
    entry_points: dict[tuple[str, str, str], tuple[str, metadata.EntryPoint]] = {}
    for package in metadata.distributions():
        for point in _points(package):  # a package may lie on the path twice: the first one counts
            if point.group in GROUPS:
                entry_points.setdefault((point.name, point.value, point.group), (_named(package), point))
    return [entry_points[key] for key in sorted(entry_points)]


def _points(package: metadata.Distribution) -> metadata.EntryPoints:
    try:
        return _OWN_POINTS.__get__(package)
    except Exception as failure:  # whatever the file of another package holds
        _UNREAD[_named(package)] = _described(failure)
        return metadata.EntryPoints(())


def _named(package: metadata.Distribution) -> str:
    try:
        return _one_line(f"{package.metadata['Name']} {package.version}")
    except Exception:
        return "a package without a name"


def _described(failure: BaseException) -> str:
    try:
        return _one_line(f"{type(failure).__name__}: {failure}").rstrip(": ")
    except Exception:  # its text may fail, too
        return type(failure).__name__


def _one_line(text: str) -> str:
    return shorten(text, 200, placeholder="...")
