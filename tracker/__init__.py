"""Model-based tracking of people in calibrated multi-camera footage."""

import hashlib
import os
import shutil
from pathlib import Path

import numba
from platformdirs import user_cache_path

_KEPT_CACHES = 3


def _keep_kernels_apart() -> None:
    """Let compiled kernels be cached in a folder named after the source of all of them.

    Numba looks only at a kernel's own file when it judges a cached one. Kernels call kernels of other files, which are
    compiled into them, so that an edit or an update of `contours.py` alone would leave `chamfer.py` scoring as before.
    """
    here = Path(__file__).resolve().parent
    sources = hashlib.sha256()
    for path in sorted(here.rglob("*.py")):
        text = path.read_bytes()
        if b"njit" in text:
            sources.update(text)
    caches = here / "__pycache__"
    if not os.access(caches if caches.is_dir() else here, os.W_OK):
        caches = user_cache_path("quadrille", appauthor=False)
    own = caches / f"kernels-{sources.hexdigest()[:16]}"
    own.mkdir(parents=True, exist_ok=True)
    os.utime(own)
    old = sorted(caches.glob("kernels-*"), key=lambda p: p.stat().st_mtime, reverse=True)
    for folder in old[_KEPT_CACHES:]:
        shutil.rmtree(folder, ignore_errors=True)
    numba.config.CACHE_DIR = str(own)


if "NUMBA_CACHE_DIR" not in os.environ:
    _keep_kernels_apart()
