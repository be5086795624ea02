"""Read one HDF5 file and write its key points as plain arrays: `python -m ... FILE FOLDER`, called by `hdf5`."""

import sys
import warnings
from pathlib import Path

import msgspec
import numpy as np

from tracker.errors import FormatError, TrackerError
from tracker.formats.keypoints.deeplabcut import is_deeplabcut_hdf5, read_deeplabcut_hdf5
from tracker.formats.keypoints.hdf5 import ReadAnswer, VideoHead
from tracker.formats.keypoints.picture_table import PictureTable
from tracker.formats.keypoints.sleap_files import read_sleap


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


def main(path: Path, folder: Path) -> None:
    """Write the key points of a file, or the reason against it, to a folder."""
    try:
        found = read_hdf5(path)
        for i, (_, table) in enumerate(found):
            np.savez(folder / f"{i}.npz", numbers=table.numbers, points=table.points)
        answer = ReadAnswer(tuple(VideoHead(str(video), table.names, table.notes) for video, table in found))
    except ImportError as error:
        package = {"sleap_io": "sleap-io"}.get(error.name or "", error.name or "sleap-io")
        answer = ReadAnswer(error=f"file {path} needs the package {package}, which is not installed", remedy="install")
    except TrackerError as error:
        answer = ReadAnswer(error=str(error))
    (folder / "answer.json").write_bytes(msgspec.json.encode(answer))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
