"""Open HDF5 files, and turn the errors of the libraries that read them into ours."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tracker.errors import FormatError, Remedy, TrackerError
from tracker.files import check_regular


@contextmanager
def open_hdf5(path: Path, where: str) -> Iterator[Any]:
    """Open an HDF5 file to read.

    Raises:
        FormatError: h5py is not installed, or reading fails, within the block too; `where` names the file.
    """
    with foreign_reader(path, where, "h5py"):
        import h5py

        with h5py.File(path, "r") as file:
            yield file


@contextmanager
def foreign_reader(path: Path, where: str, library: str) -> Iterator[None]:
    """Run a block that reads a file by a library of others, which may raise anything for a damaged file.

    Raises:
        FormatError: the library is not installed, or the block raises another error than ours.
    """
    try:
        check_regular(path)
        yield
    except TrackerError:
        raise
    except ImportError as error:
        raise FormatError(
            f"{where} needs the package {library}, which is not installed", Remedy("install_import")
        ) from error
    except Exception as error:
        words = " ".join(str(error).split())[:200] or type(error).__name__
        raise FormatError(f"{where} cannot be read: {words}; export it again") from error
