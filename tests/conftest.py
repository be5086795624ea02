"""Fixtures that several test files share."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

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
