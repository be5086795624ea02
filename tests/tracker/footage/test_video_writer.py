import av
import numpy as np
import pytest

from tracker.footage.video import open_footage
from tracker.footage.video_writer import GROUP_OF_PICTURES, VideoWriter


@pytest.mark.parametrize("fps", [25.0, 30000 / 1001])
def test_frames_come_back_in_order_with_short_groups(tmp_path, fps):
    path = tmp_path / "v.mp4"
    with VideoWriter(path, (64, 48), fps) as writer:
        for k in range(30):
            writer.write(np.full((48, 64, 3), 8 * k, dtype=np.uint8))
    footage = open_footage(path, "v")
    assert footage.n_frames == 30
    assert np.isclose(footage.fps, fps, rtol=1e-4)
    assert [round(footage.read(k).mean() / 8) for k in (29, 3, 14, 0)] == [29, 3, 14, 0]
    with av.open(str(path)) as file:
        keys = [i for i, packet in enumerate(p for p in file.demux(video=0) if p.size) if packet.is_keyframe]
    assert max(np.diff(keys)) <= GROUP_OF_PICTURES
