"""The release works away from the clone: built as wheel and sdist, installed into an empty environment, used there.

By default the environment holds links to the installed copies of the packages that the wheel requires, and nothing
else, so that no package index is needed. `make release` names interpreters in QUADRILLE_RELEASE_PYTHONS: each gets the
wheel and its requirements from the index, in the versions that a user gets today.
"""

import asyncio
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path

import aiohttp
import pytest
import yaml
from packaging.requirements import Requirement
from platformdirs import user_cache_path
from yarl import URL

pytestmark = pytest.mark.slow
ROOT = Path(__file__).resolve().parents[2]
INTERPRETERS = os.environ.get("QUADRILLE_RELEASE_PYTHONS", "").split()
LINKED = "linked"
MOST_BYTES = 12e6
"""Size of the wheel: 8 MB of bundled footage, which hardly compresses, and 2 MB of code with room to double."""
FOLDERS = {name: name for name in ("quadrille", "app", "tracker")}
FOLDERS |= {name: f"app/{name}" for name in ("static", "sample_sessions")}
"""Folders of the repository, and their places in the wheel."""
DOCUMENTS = {"README.md", "CHANGELOG.md", "LICENSE", "SECURITY.md", "CITATION.cff"}
EVERY_HELP = """
import sys
from app.main import _COMMANDS, main
assert len(_COMMANDS) > 20
for name in _COMMANDS:
    sys.argv = ["quadrille", name, "--help"]
    try:
        main()
    except SystemExit as end:
        assert not end.code, name
"""
WHERE = "import app, quadrille, tracker; print(app.__file__, quadrille.__file__, tracker.__file__)"


def account(home):
    """Environment of an account with an empty home; compiled kernels are shared."""
    hidden = {"PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV"}
    kept = {k: v for k, v in os.environ.items() if k not in hidden and not k.startswith("XDG_")}
    kernels = os.environ.get("NUMBA_CACHE_DIR") or user_cache_path("quadrille", appauthor=False) / "kernels"
    return {**kept, "HOME": str(home), "NUMBA_CACHE_DIR": str(kernels), "PYTHONUNBUFFERED": "1"}


def run(*words, cwd, home=None):
    """Run a program as an account whose home is the working folder, unless another is given."""
    done = subprocess.run(
        [*map(str, words)], cwd=cwd, env=account(home or cwd), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{words}: {done.stdout}{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Wheel and sdist: those of QUADRILLE_RELEASE_DIST, else built here by the backend that is installed."""
    if given := os.environ.get("QUADRILLE_RELEASE_DIST"):
        out = ROOT / given
    else:
        out = tmp_path_factory.mktemp("dist")
        run(sys.executable, "-m", "build", "--no-isolation", "--outdir", out, ROOT, cwd=out)
    (wheel,), (sdist,) = out.glob("*.whl"), out.glob("*.tar.gz")
    return wheel, sdist


def required_by(wheel):
    """Names of the installed distributions that the wheel needs, without its extras, and what these need."""
    with zipfile.ZipFile(wheel) as archive:
        (name,) = [n for n in archive.namelist() if n.endswith(".dist-info/METADATA")]
        text = archive.read(name).decode()
    open_, names = re.findall(r"^Requires-Dist: (.+)$", text, re.MULTILINE), set()
    while open_:
        requirement = Requirement(open_.pop())
        is_wanted = requirement.marker is None or requirement.marker.evaluate({"extra": ""})
        if is_wanted and requirement.name.lower() not in names:
            names.add(requirement.name.lower())
            open_ += metadata.distribution(requirement.name).requires or []
    return names


def link(distribution, site_packages):
    """Link the top folders and files of a distribution into another environment."""
    for file in distribution.files or []:
        top = file.parts[0]
        if top not in ("..", "__pycache__") and not (site_packages / top).is_symlink():
            (site_packages / top).symlink_to(Path(str(distribution.locate_file(top))))


@pytest.fixture(scope="module", params=INTERPRETERS or [LINKED])
def environment(request, built, tmp_path_factory):
    """Folder of the programs of an environment that holds the wheel and nothing that it does not require."""
    folder = tmp_path_factory.mktemp("environment")
    wheel, bin_ = built[0], folder / "bin"
    python = sys.executable if request.param == LINKED else request.param
    run(python, "-m", "venv", folder, cwd=folder)
    pip = [bin_ / "python", "-m", "pip", "--disable-pip-version-check", "--quiet", "install", "--no-compile"]
    if request.param == LINKED:
        (site_packages,) = folder.glob("lib/python*/site-packages")
        for name in required_by(wheel):
            link(metadata.distribution(name), site_packages)
        pip += ["--no-deps", "--no-index"]
    run(*pip, wheel, cwd=folder, home=Path.home())  # the account's own settings of pip name its index
    return bin_


@pytest.fixture
def sample(environment, tmp_path):
    """A bundled sample, copied out of the installed package."""
    (package,) = environment.parent.glob("lib/python*/site-packages/app")
    return shutil.copytree(package / "sample_sessions" / "elbow_rotation", tmp_path / "sample")


def files_of(folder):
    """Files below a folder, without those that programs make there: bytecode, and types for the check of the page."""
    made = ("__pycache__", "protocol.d.ts")
    return {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file() and not {*made} & {*p.parts}}


def test_the_wheel_holds_the_program_and_nothing_else(built):
    wheel = built[0]
    with zipfile.ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if ".dist-info/" not in name}
    assert held == {f"{place}/{name}" for folder, place in FOLDERS.items() for name in files_of(ROOT / folder)}
    print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB")
    assert wheel.stat().st_size < MOST_BYTES


def test_the_sdist_holds_sources_and_documents_and_nothing_else(built):
    with tarfile.open(built[1]) as archive:
        held = {tuple(Path(name).parts[1:]) for name in archive.getnames()}
    tops = {parts[0] for parts in held if parts}
    assert tops == {*FOLDERS, *DOCUMENTS, "docs", "pyproject.toml", "PKG-INFO", ".gitignore"}


def version():
    """Version of the project."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]


def test_the_metadata_name_the_version_and_each_python(built):
    with zipfile.ZipFile(built[0]) as archive:
        (name,) = [n for n in archive.namelist() if n.endswith(".dist-info/METADATA")]
        text = archive.read(name).decode()
    assert f"\nVersion: {version()}\n" in text
    assert yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))["version"] == version()
    assert re.findall(r"^Classifier: Programming Language :: Python :: (3\.\d+)$", text, re.MULTILINE) == [
        "3.11",
        "3.12",
        "3.13",
        "3.14",
    ]


def test_it_is_imported_from_its_own_environment(environment, tmp_path):
    places = run(environment / "python", "-c", WHERE, cwd=tmp_path).split()
    assert all(Path(place).is_relative_to(environment.parent) for place in places), places


def test_its_requirements_are_met(environment, tmp_path):
    assert "No broken requirements" in run(environment / "python", "-m", "pip", "check", cwd=tmp_path)


def test_every_command_answers_help(environment, tmp_path):
    assert run(environment / "quadrille", "--version", cwd=tmp_path) == f"quadrille {version()}\n"
    shown = run(environment / "python", "-c", EVERY_HELP, cwd=tmp_path)
    assert shown.count("usage: quadrille ") > 20


def test_a_sample_is_tracked_and_exported(environment, sample, tmp_path):
    quadrille = environment / "quadrille"
    assert run(quadrille, "info", sample, cwd=tmp_path).count("  camera ") == 4
    run(quadrille, "init", sample, "--method", "joints", "--joints", sample / "truth.trc", cwd=tmp_path)
    run(quadrille, "track", sample, "--frames", "0:3", "--no-whole-run", cwd=tmp_path)
    shown = run(quadrille, "evaluate", sample, "--reference", sample / "truth.trc", cwd=tmp_path)
    assert "person: 3 frames, 0 missing, 0 lost" in shown
    run(quadrille, "export", sample, "--out", "motion.csv", cwd=tmp_path)
    assert (tmp_path / "motion.csv").read_text("utf-8").count("\n") > 3


async def address_in(log, program):
    """The address that a program prints into its log."""
    async with asyncio.timeout(120):
        while not (found := re.search(r"http://127\.0\.0\.1:\d+/\?token=\S+", log.read_text("utf-8"))):
            assert program.poll() is None, log.read_text("utf-8")
            await asyncio.sleep(0.1)
    return found[0]


@pytest.mark.parametrize("name", ["tango", "elbow_rotation"])
async def test_a_sample_opens_in_the_page(environment, tmp_path, name):
    log = tmp_path / "log"
    words = [environment / "quadrille", "--sample", name, "--no-browser", "--port", "0"]
    with log.open("w") as out:
        program = subprocess.Popen(words, cwd=tmp_path, env=account(tmp_path), stdout=out, stderr=out)
    try:
        address = await address_in(log, program)
        async with aiohttp.ClientSession(cookie_jar=aiohttp.CookieJar(unsafe=True)) as client:
            root = await page_of(client, address)
            async with client.ws_connect(root.join(URL("ws")), origin=str(root.origin())) as socket:
                session = await socket.receive_json(timeout=120)
        assert (session["type"], session["name"]) == ("session", name)
        async with aiohttp.ClientSession() as stranger, stranger.get(address.partition("?")[0]) as refused:
            assert refused.status == 403
    finally:
        program.terminate()
        program.wait(60)
    assert "Traceback" not in log.read_text("utf-8")


async def page_of(client, address):
    """Load the page, first the one that waits for the program; returns the address that it goes on to."""
    async with asyncio.timeout(120):
        while True:
            async with client.get(address) as page:
                text = await page.text()
                assert (page.status, "<title>" in text) == (200, True)
                if root := page.headers.get("Content-Location"):
                    return page.url.join(URL(root))
            await asyncio.sleep(0.2)
