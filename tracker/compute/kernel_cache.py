"""The cache of compiled kernels: one folder for all clones of the project, keyed by the kernels' own text.

`use_kernel_cache` registers the cache with numba. The file `compiled_mark()` exists once all kernels are compiled, and
`compiled_stages` names the groups that are compiled before. Asking for either does not load numba.
"""

import hashlib
import json
import os
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any

import msgspec
from platformdirs import user_cache_path

from tracker.compute.kernel_keys import KernelKeys, UnknownSourceError
from tracker.files import write_text_atomic

_PACKAGE = Path(__file__).resolve().parent.parent
STAGES = ("posing", "contours", "evidence", "cost", "tracking")
"""Groups of kernels in the order in which a new user needs them; each needs some of the groups before it."""
_MARK, _KEYS, _STAGE = "compiled-", "keys-", "stage-"
_ORDINARY = _PACKAGE / "__pycache__"
"""Folder in which numba keeps kernels by itself."""
_OPTIONS = ("OPT", "BOUNDSCHECK", "DEBUGINFO")
"""Environment variables of numba, without their prefix, that change compiled code."""
_N_VERSIONS = 12
"""Number of versions, such as branches, whose kernels and whose keys stay in the cache. They share most kernels: the
cache of twelve takes some 50 MB."""
_PRUNE_AGE_S = 86400.0
"""Minimum age of a kernel that is deleted: a younger one may belong to a version that is still being compiled."""


class KernelLocator:
    """Locate the cached files of one kernel; implements numba's `_CacheLocator` (`numba.core.caching`)."""

    def __init__(self, py_file: str, key: str) -> None:
        self._py_file = py_file  # numba reads it for warnings
        self._key = key

    @classmethod
    def from_function(cls, py_func: Callable[..., object], py_file: str) -> "KernelLocator | None":
        """Return the locator of a function, or None to leave it to numba's ordinary cache."""
        key = kernel_keys().get(f"{py_func.__module__}.{py_func.__qualname__}")
        if key is None or not _is_in_package(py_file):
            return None
        locator = cls(py_file, key)
        try:
            locator.ensure_cache_path()
        except OSError:
            return None
        return locator

    def ensure_cache_path(self) -> None:
        """Make the cache folder; raises OSError unless it can be written."""
        _check_writable(self.get_cache_path())

    def get_cache_path(self) -> str:
        """Return the folder of the cache."""
        return str(_folder())

    def get_source_stamp(self) -> str:
        """Return the key; a cached kernel with another key is not used."""
        return self._key

    def get_disambiguator(self) -> str:
        """Return the part of the file names that distinguishes kernels of equal names."""
        return self._key


def use_kernel_cache() -> None:
    """Register the cache with numba, in the user's cache folder or in NUMBA_CACHE_DIR.

    Must run before the first kernel is decorated. If numba offers no such hook, or the folder is not writable, numba's
    ordinary cache remains in use.
    """
    import numba  # here, because `compiled_mark` is asked for before numba is needed

    if not numba.config.CACHE_DIR:
        if _folder() == _ORDINARY:
            return
        numba.config.CACHE_DIR = str(_folder())
    try:
        from numba.core.caching import CacheImpl

        locators: list[Any] = CacheImpl._locator_classes
    except (ImportError, AttributeError):
        return
    if KernelLocator not in locators:
        locators.insert(0, KernelLocator)


@lru_cache
def _is_in_package(py_file: str) -> bool:
    return _PACKAGE in Path(py_file).resolve().parents


@lru_cache
def _check_writable(folder: str) -> None:
    """Make the folder, once for all kernels; raises OSError unless it can be written."""
    os.makedirs(folder, exist_ok=True)
    tempfile.TemporaryFile(dir=folder).close()


@lru_cache(maxsize=1)
def kernel_keys() -> dict[str, str]:
    """Return the key of each kernel of the package by its dotted name.

    They are stored beside the kernels, because parsing the sources takes 0.5 s. A kernel whose source cannot be
    followed has no key.
    """
    environment, stored = _environment(), _keys_file()
    try:
        keys = msgspec.json.decode(stored.read_bytes(), type=dict[str, str])
    except (OSError, msgspec.DecodeError, RecursionError):
        keys = _computed_keys(environment)
        with suppress(OSError):  # they are then computed again
            stored.parent.mkdir(parents=True, exist_ok=True)
            write_text_atomic(stored, json.dumps(keys))
    return keys


def _environment() -> str:
    """Return the version of numba and the options that change compiled code."""
    return repr((_numba_version(), *(os.environ.get(f"NUMBA_{name}") for name in _OPTIONS)))


def _keys_file() -> Path:
    """Return the file of the keys of the present sources."""
    return _folder() / f"{_KEYS}{_digest(_PACKAGE, _environment())}.json"


@lru_cache
def _digest(package: Path, environment: str) -> str:
    """Return the digest of an environment and of the sources, which are read once: what runs does not change."""
    texts = hashlib.sha256(environment.encode())
    for path in sorted(package.rglob("*.py")):
        texts.update(f"{path.relative_to(package)}\n".encode() + path.read_bytes())
    return texts.hexdigest()[:20]


def _computed_keys(environment: str) -> dict[str, str]:
    keys: dict[str, str] = {}
    source = KernelKeys(_PACKAGE, environment)
    try:
        for module, name in source.kernels():
            try:
                keys[f"{module}.{name}"] = source.key(module, name)
            except UnknownSourceError:
                continue
    except UnknownSourceError:
        return {}
    return keys


def compiled_mark() -> Path:
    """Return the file that exists once this numba has compiled all kernels for this Python."""
    return _folder() / f"{_MARK}{_version()}"


def is_compiled() -> bool:
    """Return whether all kernels are compiled; quick also where not even their keys are known."""
    return _keys_file().exists() and compiled_mark().exists()


def compiled_stages() -> frozenset[str]:
    """Return which of the `STAGES` are compiled."""
    if compiled_mark().exists():
        return frozenset(STAGES)
    return frozenset(stage for stage in STAGES if _stage_mark(stage).exists())


def record_stage(stage: str) -> None:
    """Mark that the kernels of a stage are compiled."""
    _stage_mark(stage).touch()


def _stage_mark(stage: str) -> Path:
    return _folder() / f"{_STAGE}{_version()}-{stage}"


def _version() -> str:
    """Return what the compiled kernels depend on: their sources, numba and Python."""
    state = hashlib.sha256(repr(sorted(kernel_keys().items())).encode()).hexdigest()[:20]
    return f"{state}-{_numba_version()}-{sys.implementation.cache_tag}"


def record_compiled() -> None:
    """Mark that all kernels are compiled, and delete those of old versions."""
    compiled_mark().write_text("\n".join(kernel_keys().values()), "utf-8")
    for old in (*_newest_first(f"{_KEYS}*.json")[_N_VERSIONS:], *_newest_first(f"{_STAGE}{_version()}-*")):
        old.unlink(missing_ok=True)
    marks = _newest_first(f"{_MARK}*")
    for old in marks[_N_VERSIONS:]:
        old.unlink(missing_ok=True)
    used = {key for mark in marks[:_N_VERSIONS] for key in _text(mark).split()}
    newest = max((m.stat().st_mtime for m in marks[:1]), default=0.0)
    for kernel in _newest_first("*.nb[ic]"):
        key = kernel.name.rpartition("-")[2].split(".")[0]
        if key not in used and kernel.stat().st_mtime < newest - _PRUNE_AGE_S:
            kernel.unlink(missing_ok=True)


@lru_cache(maxsize=1)
def _folder() -> Path:
    """Return the folder of the cache; where the user's cannot be made, the package's `__pycache__`."""
    if given := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(given)
    folder = user_cache_path("quadrille", appauthor=False) / "kernels"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return _ORDINARY
    return folder


@lru_cache(maxsize=1)
def _numba_version() -> str:
    return metadata.version("numba")


def _newest_first(pattern: str) -> list[Path]:
    aged = []
    for path in _folder().glob(pattern):
        try:
            aged.append((path.stat().st_mtime, path))
        except OSError:
            continue  # another program pruned it meanwhile
    return [path for _, path in sorted(aged, reverse=True)]


def _text(path: Path) -> str:
    try:
        return path.read_text("utf-8")
    except OSError:
        return ""
