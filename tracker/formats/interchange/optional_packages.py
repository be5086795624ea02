"""Packages that only some formats need: the extra `export` of the program has them."""

from importlib import import_module
from typing import Any

from tracker.errors import FormatError


def require(package: str, title: str) -> Any:
    """Import a package that a format needs.

    Args:
        package: its name in Python.
        title: of the format, for messages.

    Raises:
        FormatError: it is not installed, or does not load.
    """
    try:
        return import_module(package)
    except ImportError as error:
        found = "none" if isinstance(error, ModuleNotFoundError) else f"one that does not load ({error})"
        raise FormatError(
            f"expected the package {package} to write {title}, found {found}; "
            "install it with: pip install 'quadrille[export]'"
        ) from error
