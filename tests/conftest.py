"""Fixtures that several test files share."""

import gc
import os
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import configuration, settings

from tracker.formats.model_toml import load_model

# Until all tests are collected: it would go through them again and again, a fifth of the time.
gc.disable()
# Programs that tests start remember their sessions there, not in the user's list.
os.environ["XDG_STATE_HOME"] = str(Path(tempfile.gettempdir()) / "quadrille-test-state")
# Stores sync each commit: in memory the tests need a sixth less time. Those of one run take 0.7 GB.
MEMORY, ROOM_BYTES = Path("/dev/shm"), 4e9
if os.access(MEMORY, os.W_OK) and shutil.disk_usage(MEMORY).free > ROOM_BYTES:
    os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", str(MEMORY))
# No time limit: the first call of a numba kernel compiles. No files in the source tree.
settings.register_profile("quadrille", deadline=None, database=None, derandomize=True)
settings.load_profile("quadrille")
configuration.set_hypothesis_home_dir(Path(tempfile.gettempdir()) / "quadrille-hypothesis")

TESTS = Path(__file__).resolve().parent
DATA = TESTS.parents[1] / "shared" / "data"


GC_THRESHOLDS = 20_000, 20, 20

WITHOUT_KERNELS = {
    *(f"tracker/{room}" for room in ("compute", "geometry", "body", "body/motion", "formats", "session")),
    *("tracker/session/store", "tracker/evidence/images", "tracker/interchange/observations", "tracker/evaluation"),
    *("app/runtime", "app/state", "app/drawing"),
}
"""Rooms whose tests call no compiled kernels, or few."""
OF_SOURCES = {
    *(f"tests/test_{name}.py" for name in ("architecture", "census", "docs", "vocabulary")),
    "tests/app/test_remedies.py",
}
"""Files whose tests read all modules; see `architecture.trees`."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Mark the tests of the library that need kernels, and run them last: the kernels are compiled meanwhile."""
    for item in items:
        folder = item.path.relative_to(TESTS).parent
        if folder.as_posix() != "." and folder.parts[0] != "browser" and folder.as_posix() not in WITHOUT_KERNELS:
            item.add_marker("kernels")
    items.sort(key=lambda item: item.get_closest_marker("kernels") is not None)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Give the tests that parse all sources to one process, and each other file to one."""
    from xdist.scheduler import LoadFileScheduling

    class OneForSources(LoadFileScheduling):
        def _split_scope(self, nodeid):
            file = super()._split_scope(nodeid)
            return "sources" if file in OF_SOURCES else file

    return OneForSources(config, log) if config.getoption("dist") == "loadfile" else None


def pytest_runtest_logreport(report):
    """Name a failure at once: a run of hours may be broken off before its summary."""
    if report.failed:
        print(f"\nfailed: {report.nodeid}", flush=True)


def pytest_collection_finish():
    """Leave what was imported and collected out of garbage collection, which otherwise costs a tenth of the time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(*GC_THRESHOLDS)
    gc.enable()


@pytest.fixture(autouse=True)
def nobody_annotates(monkeypatch):
    """Forget the annotator whom a command in this process, or an earlier run, has remembered."""
    monkeypatch.setenv("QUADRILLE_ANNOTATOR", "")


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
