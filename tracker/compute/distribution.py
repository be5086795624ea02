"""The distribution that this program is installed as, its version, and the command that adds an extra to it."""

import json
import sys
from contextlib import suppress
from functools import cache
from importlib import metadata
from itertools import pairwise
from pathlib import Path

DISTRIBUTION = "quadrille-mocap"
"""Name by which installers know the program. `quadrille` alone is a distribution of somebody else."""


@cache
def program_version() -> str:
    """Return the version of the program; "unknown" in a source tree that is not installed."""
    try:
        return metadata.version(DISTRIBUTION)
    except metadata.PackageNotFoundError:
        return "unknown"


def install_command(extra: str) -> str:
    """Return the command that installs an extra, such as `pip install 'quadrille-mocap[export]'`.

    An installer records itself as INSTALLER (PEP 376), and a clone that it links as direct_url.json (PEP 610). Tools
    that keep programs apart put each into a folder of its own.
    """
    wanted, folders = f"'{DISTRIBUTION}[{extra}]'", set(pairwise(Path(sys.prefix).parts))
    if _is_linked():
        return f"{_pip()} install -e '.[{extra}]' in the folder of the sources"
    if ("pipx", "venvs") in folders:
        return f"pipx install --force {wanted}"
    if ("uv", "tools") in folders:
        return f"uv tool install {wanted}"
    return f"{_pip()} install {wanted}"


def _record(name: str) -> str:
    """Return a file that the installer wrote; empty without one."""
    with suppress(metadata.PackageNotFoundError):
        return metadata.distribution(DISTRIBUTION).read_text(name) or ""
    return ""


def _pip() -> str:
    return "uv pip" if _record("INSTALLER").strip() == "uv" else "pip"


def _is_linked() -> bool:
    """Return whether the program is a clone that is linked, not a copy."""
    with suppress(ValueError, KeyError):
        return bool(json.loads(_record("direct_url.json"))["dir_info"].get("editable"))
    return False
