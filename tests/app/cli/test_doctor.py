"""The report on a machine: what is missing is named with its command, and nobody's name or path is in it."""

import getpass
import json
from pathlib import Path

import pytest
from command_line import output_of

from app.cli import doctor
from tracker.compute import extensions
from tracker.compute.installed_package import install_command


@pytest.fixture
def found(run):
    out = output_of(run("doctor", "--json"))
    return {f["name"]: f for f in json.loads(out)["findings"]}


def test_the_report_names_no_person_and_no_path(run):
    out = run("doctor")[1]
    assert str(Path.home()) not in out
    assert str(Path(__file__).parents[3]) not in out
    assert getpass.getuser() not in out.split()


def test_missing_parts_are_named_with_their_command(run, monkeypatch):
    monkeypatch.setattr(doctor.importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(doctor.shutil, "which", lambda name: None)
    monkeypatch.setattr(doctor, "HAS_BROWSER", False)
    out = run("doctor")[1]
    assert install_command("dask") in out
    assert "browser of another machine" in out


def test_an_extension_that_does_not_load_is_a_warning_without_its_path(found, run, monkeypatch):
    assert found["extra dask"]["state"] in ("ok", "missing")
    broken = extensions.Extension(
        "quadrille.metrics", "jerk", "other 1.0", None, "ImportError: /home/eve/lab/x.py is no"
    )
    monkeypatch.setattr(extensions, "extensions", lambda group, kind: [broken] * ("metrics" in group))
    line = next(x for x in run("doctor")[1].splitlines() if "jerk" in x)
    assert line.startswith("warning")
    assert "PATH" in line
    assert "eve" not in line


@pytest.mark.parametrize("text", ["cannot open /home/eve/a b", "C:\\Users\\eve\\x.py: none", "no path at all"])
def test_paths_are_left_out(text):
    assert "eve" not in doctor.without_paths(text)
