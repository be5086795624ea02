"""Programs of others that read exported files: packages of the extras `export` and `slow`."""

import importlib
import os

import pytest


def foreign(package):
    """Import a package of others: skip where it is missing, fail where CI promises it."""
    if os.environ.get("CI") == "true":
        return importlib.import_module(package)
    return pytest.importorskip(package, reason=f"needs {package}: pip install -e '.[export,slow]'")
