"""The viewer: a web server, the page's state, and the command line."""

from importlib.util import find_spec
from pathlib import Path

_HERE = Path(__file__).resolve().parents[1]


def _require_own_tracker(found: str | None) -> None:
    """Refuse to run with another package of the same name.

    Args:
        found: file of the package `tracker` that is first on the path; None without any.

    Raises:
        ImportError: it is not the one beside this package.
    """
    if found is None or Path(found).resolve().parents[1] != _HERE:
        raise ImportError(
            f"expected the package 'tracker' of Quadrille in {_HERE}, found {found or 'none'}; install Quadrille into "
            "an environment of its own, such as by pipx, and start it without PYTHONPATH"
        )


_spec = find_spec("tracker")
_require_own_tracker(None if _spec is None else _spec.origin)
