"""Fixtures that several test files share."""

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import configuration, settings

from tracker.formats.model_toml import load_model

# Programs that tests start remember their sessions there, not in the user's list.
os.environ["XDG_STATE_HOME"] = str(Path(tempfile.gettempdir()) / "quadrille-test-state")
# No time limit: the first call of a numba kernel compiles. No files in the source tree.
settings.register_profile("quadrille", deadline=None, database=None, derandomize=True)
settings.load_profile("quadrille")
configuration.set_hypothesis_home_dir(Path(tempfile.gettempdir()) / "quadrille-hypothesis")

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def data_folder() -> Callable[[str], Path]:
    """Find a folder of test footage beside the project: skip where it is missing, fail where CI promises it."""

    def find(name: str) -> Path:
        folder = DATA / name
        if not folder.is_dir():
            message = f"test footage '{name}' is not beside the project (expected ../shared/data/{name})"
            if os.environ.get("CI") == "true":
                pytest.fail(message)
            pytest.skip(message)
        return folder

    return find


@pytest.fixture(scope="session")
def gavrila():
    return load_model("gavrila22")
