"""The command that installs an extra, for each way in which the program may have been installed."""

import json
from importlib import metadata
from types import SimpleNamespace

import pytest

from app.remedies import command_line_text
from tracker.compute import installed_package
from tracker.compute.installed_package import install_command
from tracker.errors import Remedy

LINKED = json.dumps({"url": "file:///home/ann/my%20quadrille", "dir_info": {"editable": True}})
COPIED = json.dumps({"url": "file:///tmp/quadrille", "dir_info": {}})
OWN = "'quadrille-mocap[export]'"


@pytest.mark.parametrize(
    ("prefix", "installer", "direct", "expected"),
    [
        ("/usr", "pip\n", None, f"pip install {OWN}"),
        ("/usr", "pip\n", COPIED, f"pip install {OWN}"),
        ("/usr", "uv", None, f"uv pip install {OWN}"),
        (
            "/home/ann/.local/share/pipx/venvs/quadrille-mocap",
            "pip",
            None,
            f"pipx runpip quadrille-mocap install {OWN}",
        ),
        ("/home/ann/.local/share/uv/tools/quadrille-mocap", "uv", None, f"uv tool install {OWN}"),
        ("/home/ann/.venv", "pip", LINKED, "pip install -e '.[export]' in the folder of the sources"),
        ("/home/ann/.venv", None, None, f"pip install {OWN}"),
    ],
)
def test_an_extra_is_installed_as_the_program_was(monkeypatch, prefix, installer, direct, expected):
    records = {"INSTALLER": installer, "direct_url.json": direct}
    monkeypatch.setattr(installed_package.sys, "prefix", prefix)
    monkeypatch.setattr(metadata, "distribution", lambda name: SimpleNamespace(read_text=records.get))
    assert install_command("export") == expected
    assert command_line_text("found none", Remedy("install_extra", extra="export")).endswith(f"with: {expected}")


def test_a_tree_that_is_not_installed_names_the_distribution(monkeypatch):
    monkeypatch.setattr(installed_package, "DISTRIBUTION", "not-there")
    assert install_command("dask").endswith("install 'not-there[dask]'")
