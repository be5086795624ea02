"""The image for containers and the recipe for conda name what the project needs, and the image's commands run."""

import json
import os
import re
import socket
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
DOCKERFILE = (ROOT / "packaging" / "Dockerfile").read_text("utf-8")
CONDA_NAMES = {"msgspec": "msgspec-python", "opencv-python-headless": "py-opencv"}
"""Names on conda-forge that differ from those of pip."""


def command(instruction):
    """Words of an instruction of the image."""
    (found,) = re.findall(rf"^{instruction}\b.*?(\[.*\])$", DOCKERFILE, re.MULTILINE)
    return json.loads(found)


def test_the_recipe_names_version_and_requirements_of_the_project():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    recipe = yaml.safe_load((ROOT / "packaging" / "recipe.yaml").read_text("utf-8"))
    assert recipe["package"] == {"name": project["name"], "version": project["version"]}
    wanted = [re.fullmatch(r"([\w.-]+)(.*)", text).groups() for text in project["dependencies"]]
    wanted = [f"{CONDA_NAMES.get(name, name)} {version}" for name, version in wanted]
    assert recipe["requirements"]["run"] == [f"python {project['requires-python']}", *wanted]
    (name, place), *_ = project["scripts"].items()
    assert recipe["build"]["python"]["entry_points"] == [f"{name} = {place}"]


def has_engine():
    """Whether a Docker engine answers here."""
    try:
        return subprocess.run(["docker", "info"], capture_output=True, timeout=20).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


@pytest.mark.slow
def test_the_image_is_built_and_healthy():
    if not has_engine():
        pytest.skip("no Docker engine answers; the next test runs the image's commands")
    build = ["docker", "build", "--quiet", "--file", ROOT / "packaging" / "Dockerfile", ROOT]
    image = subprocess.run(build, check=True, capture_output=True, text=True).stdout.strip()
    container = subprocess.run(
        ["docker", "run", "--detach", image], check=True, capture_output=True, text=True
    ).stdout.strip()
    try:
        who = subprocess.run(
            ["docker", "exec", container, "id", "-u"], check=True, capture_output=True, text=True
        ).stdout
        assert who.strip() == "1000"
        until = time.monotonic() + 120
        while subprocess.run(["docker", "exec", container, *command("HEALTHCHECK")]).returncode:
            assert time.monotonic() < until
            time.sleep(1)
    finally:
        subprocess.run(["docker", "rm", "--force", container], check=True)


@pytest.mark.slow
def test_the_commands_of_the_image_start_a_healthy_page(tmp_path):
    assert re.findall(r"^USER (\w+)$", DOCKERFILE, re.MULTILINE) == ["quadrille"]
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = str(free.getsockname()[1])
    entry, check = ([word.replace("8080", port) for word in command(c)] for c in ("ENTRYPOINT", "HEALTHCHECK"))
    environment = {**os.environ, "HOME": str(tmp_path), "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    run = {"cwd": tmp_path, "env": environment}
    assert subprocess.run(check, capture_output=True, **run).returncode != 0
    program = subprocess.Popen(entry, stdout=subprocess.PIPE, text=True, **run)
    try:
        assert "?token=" in next(line for line in program.stdout if "http://" in line)
        assert subprocess.run(check, capture_output=True, **run).returncode == 0
    finally:
        program.terminate()
        program.wait(60)
