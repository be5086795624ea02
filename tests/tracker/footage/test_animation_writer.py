"""Animations, read back by Pillow."""

import imageio.v3 as iio
import numpy as np
import pytest
from PIL import Image, ImageSequence

from tracker.footage.video_writer import MAX_WIDTH_PX, AnimationWriter


@pytest.mark.parametrize("suffix", [".gif", ".webp"])
@pytest.mark.parametrize(("fps", "n"), [(24, 12), (60, 31)])
def test_an_animation_lasts_as_long_as_its_images(tmp_path, suffix, fps, n):
    with AnimationWriter(tmp_path / f"a{suffix}", fps) as writer:
        for k in range(n):
            writer.write(np.full((100, 50, 3), 8 * k, np.uint8))
    with Image.open(tmp_path / f"a{suffix}") as found:
        delays = [frame.load() and frame.info["duration"] for frame in ImageSequence.Iterator(found)]
        assert found.size == (50, 100)
    assert len(delays) == (12 if fps == 24 else 16)
    assert min(delays) >= 20
    assert abs(sum(delays) - 1000 * n / fps) <= 5


def test_wide_pictures_are_reduced_and_an_error_leaves_no_file(tmp_path):
    with AnimationWriter(tmp_path / "a.gif", 25) as writer:
        writer.write(np.zeros((720, 2 * MAX_WIDTH_PX, 3), np.uint8))
    assert iio.improps(tmp_path / "a.gif").shape[-3:-1] == (360, MAX_WIDTH_PX)
    with pytest.raises(ValueError, match="stopped"), AnimationWriter(tmp_path / "b.gif", 25):
        raise ValueError("stopped")
    assert not (tmp_path / "b.gif").exists()
