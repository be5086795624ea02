"""`quadrille doctor`: what this machine has, and what is missing for which command."""

import importlib.util
import os
import platform
import re
import shutil
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from textwrap import shorten
from typing import Any

from platformdirs import user_cache_path, user_state_path

from app.runtime.json_output import format_json
from tracker.compute.installed_package import DISTRIBUTION, install_command, program_version
from tracker.system import HAS_BROWSER, free_bytes, n_cores

WORKER_BYTES = 5 << 29
"""Memory of a worker that finds people in four views of 640 x 480: 1.6 to 2.4 GB
(`tests/benchmarks/long_recording.py`); 0.6 GB where it only tracks."""
_EXTRAS = {
    "import": ("quadrille import of DeepLabCut HDF5, SLEAP and NWB", ("h5py", "sleap_io")),
    "detect": ("quadrille detect", ("ai_edge_litert",)),
    "detect-onnx": ("quadrille detect --detector onnx", ("onnxruntime",)),
    "export": ("quadrille export to C3D, movement and NWB", ("ezc3d", "h5netcdf", "ndx_pose", "pynwb", "xarray")),
    "dask": ("quadrille batch --dask", ("distributed",)),
}
"""Use and modules of each extra of the package."""
_BROWSERS = ("chromium", "chromium-browser", "google-chrome", "firefox", "microsoft-edge", "safari")
_PACKAGES = ("numpy", "scipy", "numba", "opencv-python-headless", "av", "viser", "aiohttp", "msgspec", "tyro")
_LITTLE_BYTES = 2 << 30
"""Memory and disk space below which people are hardly found, and proxies hardly fit, bytes."""


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at."""

    name: str
    state: str
    """ok, missing or warning."""
    text: str
    """The finding; for something that is missing, also the remedy."""


def command(json: bool = False) -> None:
    """Show what this machine has, and what is missing for which command.

    The report names no people and no paths, so that it can be pasted into an issue.

    Args:
        json: print one JSON object.
    """
    found = examine()
    if json:
        print(format_json(record(found)))
        return
    print(f"quadrille {program_version()}, Python {platform.python_version()}, {platform.system()} on {_machine()}")
    width = max(len(f.name) for f in found)
    for one in found:
        print(f"{one.state:8}{one.name:{width}}  {one.text}")


def record(found: list[Finding]) -> dict[str, Any]:
    """Return the findings as one JSON object."""
    return {
        "quadrille": program_version(),
        "python": platform.python_version(),
        "system": platform.system(),
        "machine": _machine(),
        "findings": [{"name": f.name, "state": f.state, "text": f.text} for f in found],
    }


def examine() -> list[Finding]:
    """Look at cores, memory, folders, kernels, codecs, browser, extras and extensions."""
    return [
        _cores(),
        _memory(),
        *_folders(),
        _kernels(),
        _codecs(),
        _browser(),
        *_extras(),
        *_extensions(),
        Finding("packages", "ok", ", ".join(f"{name} {_version(name)}" for name in _PACKAGES)),
    ]


def _cores() -> Finding:
    n = n_cores()
    return Finding("cores", "ok" if n > 1 else "warning", f"{n}" + ("" if n > 1 else "; tracking wants two or more"))


def _memory() -> Finding:
    free = free_bytes()
    if free is None:
        return Finding("memory", "ok", "not known on this system")
    text = f"{free / 1e9:.1f} GB free, enough for {max(0, free // WORKER_BYTES)} workers of quadrille batch"
    little = f"; finding people needs {WORKER_BYTES / 1e9:.0f} GB: close other programs"
    return Finding(
        "memory", "ok" if free >= WORKER_BYTES else "warning", text + (little if free < WORKER_BYTES else "")
    )


def _folders() -> list[Finding]:
    places = {
        "cache folder": (user_cache_path("quadrille", appauthor=False), "kernels are compiled at each start"),
        "state folder": (user_state_path("quadrille", appauthor=False), "recent sessions are not remembered"),
        "temporary folder": (Path(tempfile.gettempdir()), "exports of the page fail"),
    }
    return [_folder(name, *place) for name, place in places.items()]


def _folder(name: str, path: Path, otherwise: str) -> Finding:
    there = next(p for p in (path, *path.parents) if p.exists())
    if not os.access(there, os.W_OK):
        return Finding(name, "warning", f"not writable: {otherwise}; give the account the right to write there")
    free = shutil.disk_usage(there).free
    return Finding(name, "ok" if free >= _LITTLE_BYTES else "warning", f"writable, {free / 1e9:.1f} GB free")


def _kernels() -> Finding:
    from tracker.compute.kernel_cache import STAGES, compiled_stages, is_compiled

    if is_compiled():
        return Finding("kernels", "ok", "compiled")
    done = len(compiled_stages())
    return Finding(
        "kernels", "warning", f"{done} of {len(STAGES)} groups compiled; the first start compiles the rest in a minute"
    )


def _codecs() -> Finding:
    import av

    codecs = {"H.264": "h264", "H.265": "hevc", "AV1": "libdav1d", "MJPEG": "mjpeg"}
    missing = [name for name, codec in codecs.items() if codec not in av.codecs_available]
    if missing:
        return Finding("codecs", "warning", f"videos in {', '.join(missing)} cannot be read; convert them to H.264")
    return Finding("codecs", "ok", f"{', '.join(codecs)} are read")


def _browser() -> Finding:
    names = [name for name in _BROWSERS if shutil.which(name)]
    if names or HAS_BROWSER:
        return Finding("browser", "ok", ", ".join(names) or "that of the system")
    return Finding("browser", "warning", "none found here; open the printed address in a browser of another machine")


def _extras() -> list[Finding]:
    found = []
    for extra, (use, modules) in _EXTRAS.items():
        missing = [m for m in modules if importlib.util.find_spec(m) is None]
        text = f"{use}: {', '.join(missing)} not installed; {install_command(extra)}" if missing else use
        found.append(Finding(f"extra {extra}", "missing" if missing else "ok", text))
    return found


def _extensions() -> list[Finding]:
    from tracker.compute.extensions import GROUPS, extensions, unread_packages
    from tracker.evaluation.metric import Metric
    from tracker.formats.calibrations.calibration_layout import CalibrationLayout
    from tracker.interchange.detection.detector import DetectorKind
    from tracker.interchange.exports.formats import ExportFormat

    kinds = (ExportFormat, Metric, CalibrationLayout, DetectorKind, None)
    found = []
    for group, kind in zip(GROUPS, kinds, strict=True):
        for one in extensions(group, kind):
            if one.package.startswith(f"{DISTRIBUTION} "):
                continue
            odd = one.error or (one.printed and f"its module prints when it is loaded: '{one.printed}'")
            text = f"of {one.package}" + (f": {without_paths(odd)}" if odd else "")
            name = shorten(f"{group.removeprefix('quadrille.')} {one.name}", 60)
            found.append(Finding(name, "warning" if odd else "ok", text))
    for package, error in unread_packages().items():
        found.append(Finding("entry points", "warning", f"those of {package} cannot be read: {without_paths(error)}"))
    return found


def without_paths(text: str) -> str:
    """Return a text with a word in place of each path, which may name people."""
    return re.sub(r"(?:[A-Za-z]:)?(?:[/\\][^\s'\",:;/\\]+){2,}", "PATH", text)


def _version(package: str) -> str:
    with suppress(metadata.PackageNotFoundError):
        return metadata.version(package)
    return "unknown"


def _machine() -> str:
    return platform.machine() or "unknown"
