"""The distribution that this program is installed as, its version, and the command that adds an extra to it."""

import json
import sys
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
    try:
        installed = metadata.distribution(DISTRIBUTION)
        tool, origin = installed.read_text("INSTALLER"), installed.read_text("direct_url.json")
    except metadata.PackageNotFoundError:
        tool = origin = None
    pip, wanted = "uv pip" if (tool or "").strip() == "uv" else "pip", f"'{DISTRIBUTION}[{extra}]'"
    folders = set(pairwise(Path(sys.prefix).parts))
    if json.loads(origin or "{}").get("dir_info", {}).get("editable"):
        return f"{pip} install -e '.[{extra}]' in the folder of the sources"
    if ("pipx", "venvs") in folders:
        return f"pipx runpip {DISTRIBUTION} install {wanted}"
    return f"{'uv tool' if ('uv', 'tools') in folders else pip} install {wanted}"
