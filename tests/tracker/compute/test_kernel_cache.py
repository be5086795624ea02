"""A cached kernel is used as long as all the text that it is compiled from is the same, in any clone; and no longer."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import tracker
from tracker.compute import kernel_cache
from tracker.compute.kernel_keys import KernelKeys, UnknownSourceError
from tracker.evidence.contours import part_edges

SOURCE = Path(tracker.__file__).parent

CALLEE = '''"""Callees."""
from typing import NamedTuple
import numpy as np
from tracker.compute.jit import njit

LIMIT = 10.0
OTHER = 3.0


class Pair(NamedTuple):
    """Two numbers."""

    left: float
    """The left one."""
    right: float


@njit(cache=True)
def least(pair: Pair) -> float:
    """The left one, limited."""
    # A comment.
    return min(pair.left, LIMIT)


def unrelated():
    return 1
'''
CALLER = '''"""Callers."""
from tracker.compute.jit import njit
from tracker.near import callee
from tracker.near.callee import Pair, least
from tracker.compute.jit import FAST_MATH

@njit(nogil=True, cache=True)
def twice(pair: Pair) -> float:
    return 2 * least(pair)

@njit(nogil=True, cache=True)
def by_module(x: float) -> float:
    return x * callee.OTHER
'''
PROGRAM = """
from tracker.near.caller import twice, by_module
from tracker.near.callee import Pair, least
value = twice(Pair(7.0, 100.0)), by_module(1.0)
compiled = sum(sum(k.stats.cache_misses.values()) for k in (twice, least, by_module))
print(*value, compiled)
"""


class Clone:
    """A package like the tracker, with three small kernels in two files."""

    def __init__(self, folder, cache):
        self.folder, self.cache = folder, cache
        copied = folder / "tracker" / "compute"
        copied.mkdir(parents=True)
        for path in (SOURCE / "compute").glob("*.py"):
            shutil.copy(path, copied)
        for name in ("__init__", "files", "errors", "system"):
            shutil.copy(SOURCE / f"{name}.py", folder / "tracker")
        self.near = folder / "tracker" / "near"
        self.near.mkdir()
        for name, text in {"__init__": "", "callee": CALLEE, "caller": CALLER}.items():
            (self.near / f"{name}.py").write_text(text)

    def edit(self, name, old, new):
        text = (self.near / f"{name}.py").read_text()
        assert text.count(old) == 1
        (self.near / f"{name}.py").write_text(text.replace(old, new))

    def run(self):
        """Values of the kernels, and how many were not found in the cache."""
        environment = os.environ | {"NUMBA_CACHE_DIR": str(self.cache)}
        command = [sys.executable, "-c", PROGRAM]
        done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True, check=True, env=environment)
        *values, compiled = done.stdout.split()
        return *map(float, values), int(compiled)

    def keys(self):
        source = KernelKeys(self.folder / "tracker")
        return {name: source.key(module, name) for module, name in source.kernels()}


@pytest.fixture
def clone(tmp_path):
    return Clone(tmp_path / "a", tmp_path / "cache")


@pytest.mark.slow
def test_kernels_are_compiled_again_only_if_their_text_changes(clone, tmp_path):
    twice, other, compiled = clone.run()
    assert (twice, other, compiled > 0) == (14, 3, True)
    clone.edit("callee", "# A comment.", "# Another,\n    # of two lines.")
    clone.edit("callee", "The left one, limited.", "Return the left one.")
    clone.edit("callee", "return 1\n", "return 2\n")
    assert clone.run() == (14, 3, 0)
    assert Clone(tmp_path / "b", clone.cache).run() == (14, 3, 0)  # another clone
    clone.edit("callee", "LIMIT = 10.0", "LIMIT = 5.0")  # reaches a caller in another file
    clone.edit("callee", "OTHER = 3.0", "OTHER = 4.0")
    assert clone.run()[:2] == (10, 4)


@pytest.mark.parametrize(
    ("name", "old", "new", "changed"),
    [
        ("callee", "LIMIT = 10.0", "LIMIT: float = 10.0  # the same", {"least", "twice"}),
        ("callee", "LIMIT = 10.0", "LIMIT = np.float32(10.0)", {"least", "twice"}),
        ("callee", "OTHER = 3.0", "OTHER = 4.0", {"by_module"}),
        ("callee", "return min", "return 1 + min", {"least", "twice"}),
        ("callee", "@njit(cache=True)", "@njit(cache=True, fastmath=True)", {"least", "twice"}),
        ("callee", "    left: float\n", "    first: float\n    left: float\n", {"least", "twice"}),
        ("callee", "\n\ndef unrelated", "\nOTHER += 1\n\ndef unrelated", {"least", "twice", "by_module"}),
        ("caller", "2 * least", "3 * least", {"twice"}),
        ("caller", "(nogil=True, cache=True)\ndef twice", "(**FAST_MATH)\ndef twice", {"twice"}),
        ("callee", '"""The left one."""', '"""The one on the left."""', set()),
        ("callee", '    """The left one, limited."""\n', "", set()),
        ("callee", "min(pair.left, LIMIT)", "min(\n        pair.left, LIMIT,  # both\n    )", set()),
        ("callee", "def unrelated():", "def renamed():", set()),
    ],
)
def test_the_key_changes_with_what_a_kernel_reaches(clone, name, old, new, changed):
    before = clone.keys()
    clone.edit(name, old, new)
    after = clone.keys()
    assert {k for k in before if before[k] != after[k]} == changed


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("from tracker.near import callee", "from tracker.near.callee import *\ncallee = 1"),
        ("return 2", "return return"),
    ],
)
def test_kernels_that_cannot_be_followed_have_no_key(clone, old, new):
    clone.edit("caller", old, new)
    with pytest.raises(UnknownSourceError):
        clone.keys()


@pytest.mark.slow
def test_a_kernel_depends_on_the_kernels_of_other_files(tmp_path):
    """Kernels of part_edges.py compile one of visibility.py into themselves; kernels of images need none of it."""
    copy = Path(shutil.copytree(SOURCE, tmp_path / "tracker", ignore=shutil.ignore_patterns("__pycache__")))
    before = keys_of(KernelKeys(copy))
    assert before == keys_of(KernelKeys(SOURCE))
    visibility = copy / "evidence" / "contours" / "visibility.py"
    text = visibility.read_text()
    assert text.count("far, near = shared[0, i], shared[1, i]\n") == 1
    visibility.write_text(text.replace("far, near = shared[0, i], shared[1, i]", "far, near = 1.0, 0.0"))
    after = keys_of(KernelKeys(copy))
    changed = {module for module, name in before if before[module, name] != after[module, name]}
    assert {"tracker.evidence.contours.visibility", "tracker.evidence.contours.part_edges"} <= changed
    assert not any(module.startswith(("tracker.evidence.images", "tracker.body")) for module in changed)


def keys_of(source):
    return {place: source.key(*place) for place in source.kernels()}


def test_every_kernel_is_cached_here():
    """A module that takes `njit` from numba may be loaded before the cache is registered."""
    lines = {path: path.read_text("utf-8") for path in SOURCE.rglob("*.py")}
    takers = {path.name for path, text in lines.items() if re.search(r"\bnumba import\b|\bnumba\.njit\(", text)}
    assert takers == {"jit.py"}


def test_all_kernels_have_a_key_and_use_it():
    keys = kernel_cache.kernel_keys()
    assert len(keys) > 100
    kernels = {name: thing for name, thing in vars(part_edges).items() if hasattr(thing, "py_func")}
    assert kernels
    for kernel in kernels.values():
        name = f"{kernel.py_func.__module__}.{kernel.py_func.__name__}"
        assert keys[name] in kernel._cache._cache_file._index_name
        assert Path(kernel.stats.cache_path) == kernel_cache._folder()


def test_old_kernels_are_pruned(tmp_path, monkeypatch):
    monkeypatch.setattr(kernel_cache, "_folder", lambda: tmp_path)
    for i in range(20):
        mark = tmp_path / f"compiled-{i}"
        mark.write_text(f"key{i}\n")
        kernel = tmp_path / f"f.g-key{i}.py311.nbi"
        kernel.touch()
        young = tmp_path / f"f.young-new{i}.py311.1.nbc"
        young.touch()
        for path in (mark, kernel):
            os.utime(path, (1e9 + i, 1e9 + i))
    kernel_cache.record_compiled()
    assert kernel_cache.compiled_mark().exists()
    left = {p.name for p in tmp_path.iterdir()}
    assert {i for i in range(20) if f"f.g-key{i}.py311.nbi" in left} == set(range(9, 20))
    assert {i for i in range(20) if f"compiled-{i}" in left} == set(range(9, 20))
    assert sum("young" in name for name in left) == 20


@pytest.mark.parametrize("damage", [b"[" * 100_000, b"{", b"[1]", b'{"a": 3}', b"\xff"], ids=lambda d: str(d[:6]))
def test_damaged_keys_are_computed_again(tmp_path, monkeypatch, damage):
    monkeypatch.setattr(kernel_cache, "_folder", lambda: tmp_path)
    monkeypatch.setattr(kernel_cache, "_computed_keys", lambda _: {"a": "b"})
    compute = kernel_cache.kernel_keys.__wrapped__
    assert compute() == {"a": "b"}
    (stored,) = tmp_path.glob("keys-*.json")
    stored.write_bytes(damage)
    assert compute() == {"a": "b"}
    assert stored.read_bytes() == b'{"a": "b"}'
