"""Read one HDF5 file and write its key points as plain arrays: `python -m ... FILE FOLDER`, called by `hdf5`.

With a file of changes in the folder, they are made in the copy of the file there instead.
"""

import sys
import warnings
from pathlib import Path

import msgspec
import numpy as np

from tracker.errors import FormatError, Remedy, TrackerError
from tracker.formats.keypoints.deeplabcut import is_deeplabcut_hdf5, patch_deeplabcut_hdf5, read_deeplabcut_hdf5
from tracker.formats.keypoints.hdf5 import CHANGES, PATCHED, ReadAnswer, VideoHead
from tracker.formats.keypoints.picture_table import PictureTable
from tracker.formats.keypoints.sleap_files import read_sleap
from tracker.geometry.arrays import Array


def read_hdf5(path: Path) -> list[tuple[Path, PictureTable]]:
    """Read the key points of each video of a file, with the video's path.

    Raises:
        FormatError: a package is not installed, or the file is malformed.
        ImportError: a package is not installed.
    """
    where = f"file {path}"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if path.suffix.lower() == ".h5" and is_deeplabcut_hdf5(path):
                return [(path, read_deeplabcut_hdf5(path))]
            return read_sleap(path)
    except (TrackerError, ImportError):
        raise
    except Exception as error:  # the libraries raise anything for a damaged file
        words = " ".join(str(error).split())[:200] or type(error).__name__
        raise FormatError(f"{where} cannot be read: {words}; export it again") from error


def _change(path: Path, folder: Path) -> None:
    """Replace points in the copy of a file.

    Raises:
        FormatError: it is no table of DeepLabCut.
    """
    if path.suffix.lower() != ".h5" or not is_deeplabcut_hdf5(path):
        raise FormatError(
            f"expected a table of DeepLabCut to replace points in, found another kind of file: {path}",
            Remedy("export_other_format"),
        )
    changes: dict[int, list[tuple[int, Array]]] = {}
    with np.load(folder / CHANGES, allow_pickle=False) as arrays:
        rows, people = arrays["rows"].tolist(), arrays["people"].tolist()
        for row, person, values in zip(rows, people, arrays["values"], strict=True):
            changes.setdefault(row, []).append((person, values))
    patch_deeplabcut_hdf5(folder / PATCHED, changes)


def main(path: Path, folder: Path) -> None:
    """Write the key points of a file, or the reason against it, to a folder; or change its copy there."""
    try:
        found = []
        if (folder / CHANGES).exists():
            _change(path, folder)
        else:
            found = read_hdf5(path)
        for i, (_, table) in enumerate(found):
            np.savez(folder / f"{i}.npz", numbers=table.numbers, points=table.points)
        answer = ReadAnswer(tuple(VideoHead(str(video), table.names, table.notes) for video, table in found))
    except ImportError as error:
        package = {"sleap_io": "sleap-io"}.get(error.name or "", error.name or "sleap-io")
        answer = ReadAnswer(error=f"file {path} needs the package {package}, which is not installed", remedy="install")
    except TrackerError as error:
        answer = ReadAnswer(error=str(error), remedy="other format" if error.remedy else "")
    (folder / "answer.json").write_bytes(msgspec.json.encode(answer))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
