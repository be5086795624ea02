"""Quadrille's packages `app` and `tracker` beside another project's packages of the same names."""

import subprocess
import sys

import pytest

from tracker.system import own_module

OTHERS = "NAME = 'of another project'\n"


@pytest.fixture
def project(tmp_path):
    """Folder of a project with packages `app` and `tracker` of its own."""
    for name in ("app", "tracker"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text(OTHERS)
    return tmp_path


def run(project, *words):
    return subprocess.run([sys.executable, *words], cwd=project, capture_output=True, text=True)


def test_the_program_runs_from_their_folder(project):
    done = run(project, "-m", "quadrille", "--version")
    assert (done.returncode, done.stdout.split()[:1]) == (0, ["quadrille"]), done.stderr


@pytest.mark.slow
def test_processes_that_it_starts_find_their_own_packages(project, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(project))
    done = subprocess.run([*own_module("quadrille"), "--version"], cwd=project, capture_output=True, text=True)
    assert (done.returncode, done.stdout.split()[:1]) == (0, ["quadrille"]), done.stderr


@pytest.mark.slow
def test_the_library_is_imported_beside_another_app(project):
    done = run(project, "-c", "import app, quadrille; quadrille.read_poses; print(app.NAME, quadrille.TrackerError)")
    assert done.stdout == "of another project <class 'tracker.errors.TrackerError'>\n", done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tracker", "app"])
def test_another_package_that_was_imported_before_is_named(project, name):
    done = run(project, "-c", f"import {name}, quadrille; quadrille.serve")
    assert f"expected the package '{name}' of Quadrille" in done.stderr
    assert f"found {project / name}" in done.stderr
