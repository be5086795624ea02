"""Motion capture of people from several calibrated cameras: the library's public face.

    import quadrille

    quadrille.track("walk", find_missing=True, acquire_sizes=True)
    print(quadrille.read_poses("walk").joint("left_elbow"))

Other programs import this package alone: docs/library.md describes its names, which are stable within a major version.
They are imported when they are first used, because they load all rooms of `tracker`.
"""

import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from app.server.notebook import serve
    from tracker.api.results import evaluate, export, judge, read_poses
    from tracker.api.sessions import new_session, open_session
    from tracker.api.work import acquire, find, track
    from tracker.errors import TrackerError
    from tracker.evaluation.metric import ComparedJoints, Metric
    from tracker.interchange.exports.formats import ExportFormat

__all__ = [
    "ComparedJoints",
    "ExportFormat",
    "Metric",
    "TrackerError",
    "acquire",
    "evaluate",
    "export",
    "find",
    "judge",
    "new_session",
    "open_session",
    "read_poses",
    "serve",
    "track",
]
_PLACES = {
    "app.server.notebook": ("serve",),
    "tracker.api.results": ("evaluate", "export", "judge", "read_poses"),
    "tracker.api.sessions": ("new_session", "open_session"),
    "tracker.api.work": ("acquire", "find", "track"),
    "tracker.errors": ("TrackerError",),
    "tracker.evaluation.metric": ("ComparedJoints", "Metric"),
    "tracker.interchange.exports.formats": ("ExportFormat",),
}
_MODULES = {name: module for module, names in _PLACES.items() for name in names}
_PLACE = str(Path(__file__).resolve().parents[1])
"""Folder of the packages `quadrille`, `app` and `tracker`."""


def __getattr__(name: str) -> Any:
    """Import one of the names of `__all__`."""
    if name not in _MODULES:
        raise AttributeError(f"module 'quadrille' has no attribute '{name}'")
    module = _MODULES[name]
    for package in {"tracker", module.partition(".")[0]}:
        require_own(package)
    return getattr(import_module(module), name)


def __dir__() -> list[str]:
    """List the names for other programs."""
    return __all__


def require_own(package: str) -> None:
    """Import a package from beside this one, even where another of that name comes first on the path.

    Raises:
        ImportError: the program has imported another one before.
    """
    sys.path.insert(0, _PLACE)
    try:
        found = import_module(package).__file__
    finally:
        sys.path.remove(_PLACE)
    if found is None or Path(found).resolve().parents[1] != Path(_PLACE):
        raise ImportError(
            f"expected the package '{package}' of Quadrille in {_PLACE}, found {found or 'a folder of that name'}, "
            "which this program imported before; import quadrille first, or rename your own package"
        )
