"""A video from elsewhere makes the program read no other file, and nothing from the network."""

from pathlib import Path

import pytest
from clips import encode

from tracker.errors import RecordingError
from tracker.footage.video import VideoFile

LISTS = {
    "hls": "#EXTM3U\n#EXT-X-TARGETDURATION:9\n#EXTINF:9,\n{clip}\n#EXT-X-ENDLIST\n",
    "remote": "#EXTM3U\n#EXT-X-TARGETDURATION:9\n#EXTINF:9,\nhttp://127.0.0.1:9/a.ts\n#EXT-X-ENDLIST\n",
    "concat": "ffconcat version 1.0\nfile {name}\n",
    "sdp": "v=0\no=- 0 0 IN IP4 127.0.0.1\ns=x\nc=IN IP4 127.0.0.1\nt=0 0\nm=video 5004 RTP/AVP 96\n",
}
"""Files that name another place, in the forms in which libav reads such lists."""


@pytest.mark.parametrize("kind", LISTS)
@pytest.mark.parametrize("suffix", [".mp4", ".m3u8", ".ts"])
def test_a_list_of_other_files_is_no_video(tmp_path, kind, suffix):
    clip = encode(tmp_path / "secret.ts", n=4)
    path = tmp_path / f"cam{suffix}"
    path.write_text(LISTS[kind].format(clip=clip, name=clip.name))
    # Lists of HLS under another suffix are not known to libav.
    unknown = "|not a video" if suffix != ".m3u8" else ""
    with pytest.raises(RecordingError, match=f"expected a video in one file, found a playlist{unknown}"):
        VideoFile(path, "cam")


@pytest.mark.parametrize("name", ["concat:a.mp4", "http:x.mp4", "%d.mp4", "a|b.mp4"])
def test_the_name_of_a_video_is_no_address(tmp_path, name, monkeypatch):
    monkeypatch.chdir(tmp_path)
    encode(tmp_path / "a.mp4", n=3).rename(tmp_path / name)
    video = VideoFile(Path(name), "cam")
    assert video.n_frames == 3
    video.close()
