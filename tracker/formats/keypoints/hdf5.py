"""Read HDF5 files (SLEAP, NWB, DeepLabCut) in a process of their own, and replace points in them.

The HDF5 library hangs on some damaged files, or ends the process that reads them. So another process reads a file,
within limits of time and memory, and writes plain arrays: this module as a program, with the file and a folder. With a
file of changes in the folder, they are made in the copy of the file there instead.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from tracker.errors import FormatError, Remedy, TrackerError
from tracker.files import check_regular
from tracker.formats.keypoints.deeplabcut import is_deeplabcut_hdf5, patch_deeplabcut_hdf5, read_deeplabcut_hdf5
from tracker.formats.keypoints.nwb_files import is_of_points, patch_nwb, read_nwb
from tracker.formats.keypoints.picture_table import Changes, PictureTable
from tracker.formats.keypoints.sleap_files import is_analysis, patch_analysis, patch_project, read_sleap
from tracker.formats.number_rows import MAX_VALUES, check_size
from tracker.geometry.arrays import Array
from tracker.system import limit_memory, own_module
from tracker.validation import quoted

CHANGES, PATCHED = "changes.npz", "patched"
"""Names of the file of changes to a file of key points, and of the copy that gets them, without its suffix."""


class ReadingLimits(NamedTuple):
    """Limits of the process that reads a file."""

    seconds: float
    """To load sleap-io takes 2 s; damaged files may take for ever."""
    memory_bytes: int
    """Addresses that it may take up, where the system can limit them: room for the largest table a few times."""


LIMITS = ReadingLimits(300.0, 16 * np.dtype(float).itemsize * MAX_VALUES)
"""Tables of the largest size take 0.3 GB, and are held up to five times; libraries take up 0.5 GB."""

_REMEDIES = {"install": Remedy("install_extra", extra="import"), "other format": Remedy("export_other_format")}


class VideoHead(msgspec.Struct):
    """The key points of one video, but for the arrays."""

    video: str
    names: tuple[str, ...]
    notes: tuple[str, ...] = ()
    is_by_hand: bool = False


class ReadAnswer(msgspec.Struct):
    """The answer of the process that reads a file."""

    videos: tuple[VideoHead, ...] = ()
    error: str = ""
    """Sentence on why it cannot be read; empty if it can."""
    remedy: str = ""
    """One of `_REMEDIES`; empty if there is none."""


def read_hdf5_apart(path: Path) -> list[tuple[Path, PictureTable]]:
    """Read the key points of each video of a file, with the video's path.

    Raises:
        FormatError: the file is malformed, a package is not installed, or the reading process fails or takes too long.
    """
    with _folder_for(path) as folder:
        out = []
        for i, video in enumerate(_answer(path, folder).videos):
            with np.load(folder / f"{i}.npz", allow_pickle=False) as arrays:
                numbers, points, tracks = arrays["numbers"], arrays["points"], arrays["tracks"]
            more = {"notes": video.notes, "is_by_hand": video.is_by_hand}
            table = PictureTable(video.names, numbers, points, tracks=tracks if tracks.size else None, **more)
            out.append((Path(video.video), table))
        return out


def patch_hdf5_apart(path: Path, changes: Mapping[int, Changes]) -> bytes:
    """Return a file with points of some rows replaced, by the number of the video; all other numbers stay.

    Raises:
        FormatError: points of such a file cannot be replaced, or a table has no columns left for a new person; else as
            `read_hdf5_apart`.
    """
    flat = [
        (video, row, person, values)
        for video, rows in changes.items()
        for row, people in rows.items()
        for person, values in people
    ]
    *numbers, values = zip(*flat, strict=True)
    with _folder_for(path) as folder:
        np.savez(folder / CHANGES, numbers=np.array(numbers), values=np.stack(values))
        copy = folder / (PATCHED + path.suffix.lower())
        shutil.copyfile(path, copy)
        _answer(path, folder)
        return copy.read_bytes()


@contextmanager
def _folder_for(path: Path) -> Generator[Path, None, None]:
    """Make a temporary folder for a file and its answer; errors within become sentences."""
    where = f"file {path}"
    try:
        check_regular(path)
        with tempfile.TemporaryDirectory() as folder:
            yield Path(folder)
    except subprocess.TimeoutExpired as error:
        found = f"it took over {error.timeout:.0f} s, as damaged files do"
        raise FormatError(f"{where} cannot be read: {found}; export it again") from error
    except OSError as error:
        raise FormatError(f"{where} cannot be read: {error.strerror or error}; check the path") from error


def _answer(path: Path, folder: Path) -> ReadAnswer:
    """Run the other process on a file, and return its answer from the folder."""
    root = str(Path(__file__).resolve().parents[3])
    # Each thread of a library for matrices would take up addresses, which are limited.
    environment = os.environ | dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    environment |= {"PYTHONPATH": os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH")]))}
    words = [*own_module("tracker.formats.keypoints.hdf5"), str(path.resolve()), str(folder)]
    subprocess.run(
        words, env=environment, timeout=LIMITS.seconds, capture_output=True, check=False, stdin=subprocess.DEVNULL
    )
    try:
        answer = msgspec.json.decode((folder / "answer.json").read_bytes(), type=ReadAnswer)
    except (OSError, msgspec.DecodeError) as error:
        raise FormatError(f"file {path} cannot be read: its library failed; export it again") from error
    if answer.error:
        raise FormatError(answer.error, _REMEDIES.get(answer.remedy))
    return answer


_PICTURES = re.compile(r"video\d*(/.*)?")
"""Paths of pictures in packages of SLEAP, which are not read."""

Tables = list[tuple[Path, PictureTable]]
"""Key points of each video, with its path."""


def read_hdf5(path: Path) -> Tables:
    """Read the key points of each video of a file, with the video's path.

    Raises:
        FormatError: a package is not installed, or the file is malformed.
        ImportError: a package is not installed.
    """
    where = f"file {path}"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            check_datasets(path)
            if path.suffix.lower() == ".h5" and is_deeplabcut_hdf5(path):
                return [(path, read_deeplabcut_hdf5(path))]
            if path.suffix.lower() == ".nwb":
                return read_nwb(path)
            return read_sleap(path)
    except (TrackerError, ImportError):
        raise
    except Exception as error:  # the libraries raise anything for a damaged file
        words = " ".join(str(error).split())[:200] or type(error).__name__
        raise FormatError(f"{where} cannot be read: {words}; export it again") from error


def check_datasets(path: Path) -> None:
    """Check the sizes of all data that are read later, and that they lie in the file as they are.

    Raises:
        FormatError: a dataset is too large, or lies in another file. h5py raises other errors for a damaged file.
        ImportError: h5py is not installed.
    """
    import h5py

    where = f"file {path}"
    links, items = list[tuple[str, Any]](), list[tuple[str, Any]]()
    with h5py.File(path, "r") as file:
        file.visititems_links(lambda name, link: links.append((name, link)))
        file.visititems(lambda name, item: items.append((name, item)))
        elsewhere = [name for name, link in links if isinstance(link, h5py.ExternalLink)]
        for name, item in items:
            if not isinstance(item, h5py.Dataset) or _PICTURES.fullmatch(name):
                continue
            if path.suffix.lower() == ".nwb" and not is_of_points(item.parent):
                continue  # NWB has the recordings of other instruments too
            n_numbers = -(-item.dtype.itemsize // np.dtype(float).itemsize)  # of eight bytes, in one entry
            check_size((*(item.shape or ()), max(n_numbers, 1)), f"{where}, {quoted(name)}")
            properties = item.id.get_create_plist()
            filters = {properties.get_filter(i)[0] for i in range(properties.get_nfilters())}
            if max(filters - {h5py.h5z.FILTER_LZF}, default=0) >= h5py.h5z.FILTER_RESERVED:
                raise FormatError(f"{where}: expected data packed by gzip or LZF, found {quoted(name)} in another way")
            elsewhere += [name] * bool(item.is_virtual or item.external)
    if elsewhere := [name for name in elsewhere if not _PICTURES.fullmatch(name)]:
        raise FormatError.mismatch(where, "all data in one file", f"{quoted(elsewhere[0])} in another")


def _change(path: Path, folder: Path) -> None:
    """Replace points in the copy of a file.

    Raises:
        FormatError: points of such a file cannot be replaced.
    """
    changes: dict[int, dict[int, list[tuple[int, Array]]]] = {}
    with np.load(folder / CHANGES, allow_pickle=False) as arrays:
        for (video, row, person), values in zip(arrays["numbers"].T.tolist(), arrays["values"], strict=True):
            changes.setdefault(video, {}).setdefault(row, []).append((person, values))
    copy, suffix = folder / (PATCHED + path.suffix.lower()), path.suffix.lower()
    if suffix == ".slp":
        patch_project(copy, changes)
    elif suffix == ".h5" and is_deeplabcut_hdf5(path):
        patch_deeplabcut_hdf5(copy, changes[0])
        return
    elif suffix == ".h5" and is_analysis(path):
        patch_analysis(copy, changes[0])
    elif suffix == ".nwb":
        patch_nwb(copy, changes)
    else:
        expected = "a project or an analysis of SLEAP, or a table of DeepLabCut, to replace points in"
        raise FormatError.mismatch("", expected, f"another kind of file: {path}", Remedy("export_other_format"))
    _check(read_hdf5(path), read_hdf5(copy), changes, path)


def _check(before: Tables, after: Tables, changes: Mapping[int, Changes], path: Path) -> None:
    """Compare a changed file with the file that it was, as sleap-io reads them.

    Raises:
        FormatError: something else changed than what should.
    """
    for video, ((_, old), (_, new)) in enumerate(zip(before, after, strict=True)):
        rows = changes.get(video, {})
        others = np.setdiff1d(np.arange(len(old.numbers)), list(rows))
        n = min(old.points.shape[1], new.points.shape[1])  # one more person makes the table wider
        is_same = np.array_equal(old.numbers, new.numbers) and np.array_equal(
            old.points[others, :n], new.points[others, :n], equal_nan=True
        )
        wanted = [(new.points[row], values) for row, people in rows.items() for _, values in people]
        if not is_same or not all(_holds(people, values) for people, values in wanted):
            expected = f"the points of file {path} in their usual order"
            raise FormatError.mismatch("", expected, "another one; nothing is changed", Remedy("export_other_format"))


def _holds(people: Array, values: Array) -> bool:
    """Return whether somebody in a picture has some points; rows of NaN are not compared, absent ones are absent."""
    seen = values[values[:, 2] > 0, :2], people[:, values[:, 2] > 0, :2]
    return bool((np.isclose(*seen).all(axis=(1, 2)) & np.isnan(people[:, values[:, 2] == 0, 0]).all(axis=1)).any())


def main(path: Path, folder: Path) -> None:
    """Write the key points of a file, or the reason against it, to a folder; or change its copy there."""
    try:
        found = []
        if (folder / CHANGES).exists():
            _change(path, folder)
        else:
            found = read_hdf5(path)
        for i, (_, table) in enumerate(found):
            tracks = np.array([], dtype=np.str_) if table.tracks is None else table.tracks
            np.savez(folder / f"{i}.npz", numbers=table.numbers, points=table.points, tracks=tracks)
        answer = ReadAnswer(tuple(VideoHead(str(video), t.names, t.notes, t.is_by_hand) for video, t in found))
    except ImportError as error:
        package = {"sleap_io": "sleap-io"}.get(error.name or "", error.name or "sleap-io")
        answer = ReadAnswer(error=f"file {path} needs the package {package}, which is not installed", remedy="install")
    except TrackerError as error:
        answer = ReadAnswer(error=str(error), remedy="other format" if error.remedy else "")
    (folder / "answer.json").write_bytes(msgspec.json.encode(answer))


if __name__ == "__main__":
    limit_memory(LIMITS.memory_bytes)
    main(Path(sys.argv[1]), Path(sys.argv[2]))
