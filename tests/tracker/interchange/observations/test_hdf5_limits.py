"""Sizes, types and filters of HDF5 files are checked before any data is read; the process that reads has limits."""

import multiprocessing
import tracemalloc

import numpy as np
import pytest

from tracker.errors import FormatError
from tracker.formats.keypoints import hdf5
from tracker.formats.keypoints.hdf5 import LIMITS, check_datasets, read_hdf5

h5py = pytest.importorskip("h5py")


def write_analysis(path, shape, name="tracks", **more):
    with h5py.File(path, "w") as file:
        file.create_dataset(name, shape=shape, dtype="f8", compression="gzip", **more)
        file["track_occupancy"] = np.ones((3, 1), np.uint8)
    return path


@pytest.mark.parametrize("shape", [(13, 2, 30_000_000), (1, 2, 13, 3_200_000_000)])
@pytest.mark.parametrize("suffix", [".h5", ".slp"])
def test_sizes_are_checked_before_data_are_read(tmp_path, shape, suffix):
    path = write_analysis(tmp_path / f"a{suffix}", shape)
    assert path.stat().st_size < 50_000
    tracemalloc.start()
    with pytest.raises(FormatError, match=r"'tracks': expected at most 40000000 values, found more"):
        read_hdf5(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 50_000_000


def test_wide_entries_count_by_their_size(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        table = file.create_group("df_with_missing")
        table.create_dataset("table", shape=(2_000,), dtype=[("index", "i8"), ("values_block_0", "f8", (40_000,))])
    with pytest.raises(FormatError, match="'df_with_missing/table': expected at most 40000000 values"):
        read_hdf5(tmp_path / "a.h5")


def test_recordings_of_other_instruments_may_be_long(tmp_path):
    """Only key points are read from NWB, and no pictures from packages of SLEAP."""
    path = write_analysis(tmp_path / "a.nwb", (50_000_000,), "acquisition/voltage")
    with pytest.raises(FormatError, match="expected key points of ndx-pose, found none"):
        read_hdf5(path)
    check_datasets(write_analysis(tmp_path / "a.slp", (50_000_000,), "video0/video"))


@pytest.mark.parametrize("kind", ["external link", "external data", "virtual data"])
def test_data_lie_in_the_file_itself(tmp_path, kind):
    other = write_analysis(tmp_path / "other.h5", (3,))
    with h5py.File(tmp_path / "a.h5", "w") as file:
        if kind == "external link":
            file["tracks"] = h5py.ExternalLink(str(other), "/tracks")
        elif kind == "external data":
            file.create_dataset("tracks", shape=(3,), dtype="f8", external=[(str(other), 0, 24)])
        else:
            layout = h5py.VirtualLayout(shape=(3,), dtype="f8")
            layout[:] = h5py.VirtualSource(str(other), "tracks", shape=(3,))
            file.create_virtual_dataset("tracks", layout)
    with pytest.raises(FormatError, match="expected all data in one file, found 'tracks' in another"):
        read_hdf5(tmp_path / "a.h5")


def test_filters_of_plug_ins_are_refused(tmp_path):
    path = write_analysis(tmp_path / "a.h5", (3,), shuffle=True, fletcher32=True)
    data = path.read_bytes()
    check_datasets(path)
    before = b"deflate"
    at = data.index(before) - 8  # the number of the filter, before the lengths of its name and values
    assert data[at : at + 2] == b"\x01\x00"
    path.write_bytes(data[:at] + (32001).to_bytes(2, "little") + data[at + 2 :])
    with pytest.raises(FormatError, match="expected data packed by gzip or LZF, found 'tracks' in another way"):
        read_hdf5(path)


def allocate_beyond_the_limit():
    hdf5.limit_memory(hdf5.LIMITS.memory_bytes)
    try:
        np.empty(LIMITS.memory_bytes, np.uint8)
    except MemoryError:
        raise SystemExit(3) from None


def test_the_process_that_reads_has_limited_memory():
    pytest.importorskip("resource")
    child = multiprocessing.get_context("fork").Process(target=allocate_beyond_the_limit)
    child.start()
    child.join()
    assert child.exitcode == 3
