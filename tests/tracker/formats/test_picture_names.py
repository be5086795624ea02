"""The number of the picture in names: the one that runs."""

import hashlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracker.formats.keypoints.picture_names import picture_names

N = range(12)


def digest(k, n):
    return hashlib.md5(str(k).encode(), usedforsecurity=False).hexdigest()[:n]


@pytest.mark.parametrize(
    ("names", "numbers", "label"),
    [
        ([f"FRONT_{k:012d}" for k in N], N, "FRONT"),
        ([f"{k:012d}" for k in N], N, ""),
        ([f"cam01_{k}" for k in N], N, "cam01"),
        (["cam01_12"], [12], "cam01"),
        ([f"FRONT_{k:06d}_30fps" for k in N], N, "FRONT_30fps"),
        (["FRONT_000012_30fps"], [12], "FRONT_30fps"),
        ([f"FRONT_{k:06d}_jpg.rf.{digest(k, 32)}" for k in N], N, "FRONT_jpg.rf"),
        ([f"{digest(k, 8)}-FRONT_{k:06d}" for k in N], N, "FRONT"),
        ([f"mask_{k:05d}_obj1" for k in N], N, "mask_obj1"),
        (["mask_00012_obj1"], [12], "mask_obj1"),
        ([f"{k:06d}_0" for k in N], N, "0"),
        ([f"frame{k}_mask_1" for k in N], N, "frame_mask_1"),
        ([f"20240501_120000_{k}" for k in N], N, "20240501_120000"),
        ([f"Camera 2 frame {k}" for k in N], N, "Camera 2 frame"),
        (["img003", "img009", "img014"], [3, 9, 14], "img"),
    ],
)
def test_the_number_that_runs_is_the_picture(names, numbers, label):
    found = picture_names(names)
    assert [f.number for f in found] == list(numbers)
    assert {f.label for f in found} == {label}


def test_names_without_a_number():
    assert picture_names(["calibration", "x_99999999999999999999"]) == [None, None]


@pytest.mark.parametrize(
    "pattern", ["cam{v}_{k:06d}", "cam{v}_{k}", "obj{v}_{k}", "{k:05d}_{v}", "frame_{k}_person_{v}"]
)
def test_numbers_of_cameras_objects_and_people_are_labels(pattern):
    """Also if there are more of them than pictures."""
    names = {(v, k): pattern.format(v=v, k=k) for v in range(4) for k in range(3)}
    found = dict(zip(names, picture_names(list(names.values())), strict=True))
    assert all(f.number == k for (_, k), f in found.items())
    assert len({(f.label, f.number) for f in found.values()}) == len(names)


@pytest.mark.slow
@given(
    st.lists(st.integers(0, 99_999), min_size=2, max_size=20, unique=True),
    st.sampled_from(["", "left", "cam3_", "A1-", "2024-05-01_"]),
    st.sampled_from(["", "_keypoints", "_30fps", "_0", "_obj2", "-mask"]),
)
def test_constants_do_not_matter(numbers, before, after):
    """Leading zeros are there, as programs write them."""
    found = picture_names([f"{before}{n:06d}{after}" for n in numbers])
    assert [f.number for f in found] == numbers
    assert len({f.label for f in found}) == 1
