"""Packages that are installed only where something needs them, such as a format of the extra `export`."""

from importlib import import_module
from typing import Any

from tracker.errors import FormatError, Remedy


def require(package: str, title: str, use: str = "write", extra: str = "export") -> Any:
    """Import a package that a format or a detector needs.

    Args:
        package: its name in Python.
        title: of the format or the detector, for messages.
        use: verb that says what for.
        extra: of the program, that installs it.

    Raises:
        FormatError: it is not installed, or does not load.
    """
    try:
        return import_module(package)
    except ImportError as error:
        found = "none" if isinstance(error, ModuleNotFoundError) else f"one that does not load ({error})"
        expected = f"the package {package} to {use} {title}"
        raise FormatError.mismatch("", expected, found, Remedy("install_extra", extra=extra)) from error
