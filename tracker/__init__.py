"""Model-based tracking of people in calibrated multi-camera footage.

    import tracker

    tracker.track("walk", find_missing=True, acquire_sizes=True)
    print(tracker.read_poses("walk").joint("left_elbow"))

The names of `__all__` are the library for other programs: docs/library.md describes them. They are stable within a
major version. They are imported when they are first used, because they load all rooms.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tracker.api.results import evaluate, export, judge, read_poses
    from tracker.api.sessions import new_session, open_session
    from tracker.api.work import acquire, find, track
    from tracker.errors import TrackerError

__all__ = [
    "TrackerError",
    "acquire",
    "evaluate",
    "export",
    "find",
    "judge",
    "new_session",
    "open_session",
    "read_poses",
    "track",
]
_PLACES = {
    "tracker.api.results": ("evaluate", "export", "judge", "read_poses"),
    "tracker.api.sessions": ("new_session", "open_session"),
    "tracker.api.work": ("acquire", "find", "track"),
    "tracker.errors": ("TrackerError",),
}
_MODULES = {name: module for module, names in _PLACES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import one of the names of `__all__`."""
    if name not in _MODULES:
        raise AttributeError(f"module 'tracker' has no attribute '{name}'")
    return getattr(import_module(_MODULES[name]), name)


def __dir__() -> list[str]:
    """List the names for other programs."""
    return __all__
