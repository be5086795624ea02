"""Make long footage of short footage, which is played forth and back.

One round is encoded, and its packets are repeated, so that 20,000 frames take seconds.
"""

from collections.abc import Iterator, Sequence
from contextlib import closing
from itertools import chain, cycle, islice
from pathlib import Path

import av

from tracker.footage.video import open_footage
from tracker.footage.video_writer import VideoWriter


def forth_and_back(n_frames: int, n: int) -> Iterator[int]:
    """The first n frames of a recording that is played to its end, back to its beginning, and so on, without a jump."""
    return islice(cycle(chain(range(n_frames), range(n_frames - 2, 0, -1))), n)


def write_looped(source: Path, path: Path, n: int) -> None:
    """Write a video of n frames that shows another one forth and back.

    Args:
        source: video of a few seconds.
        path: to write; beside it, the frames of one round are encoded.
        n: number of frames, rounded up to whole rounds.
    """
    with closing(open_footage(source, source.stem)) as footage:
        images = [footage.read(k) for k in range(footage.n_frames)]
    once = path.with_suffix(".once.mp4")
    with av.open(str(source)) as video:
        fps = float(video.streams.video[0].average_rate or 30)
    n_round = 2 * len(images) - 2
    height, width = images[0].shape[:2]
    with VideoWriter(once, (width, height), fps) as writer:
        for k in forth_and_back(len(images), n_round):
            writer.write(images[k])
    _repeat(once, path, n_round, -(-n // n_round))
    once.unlink()


def _repeat(once: Path, path: Path, n_round: int, times: int) -> None:
    """Write the packets of a video several times, one after the other; the first of them is decoded alone."""
    with av.open(str(path), "w") as out:
        stream = None
        for number in range(times):
            with av.open(str(once)) as video:
                (source,) = video.streams.video
                stream = stream or out.add_stream_from_template(source)
                step = round(1 / (source.average_rate * source.time_base))
                for packet in video.demux(source):
                    if packet.dts is None:
                        continue
                    packet.pts += number * n_round * step
                    packet.dts += number * n_round * step
                    packet.stream = stream
                    out.mux(packet)


def write_all(sources: Sequence[Path], folder: Path, n: int) -> list[Path]:
    """Write looped footage of several cameras into a folder; return the files. Those that exist are kept."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / source.name for source in sources]
    for source, file in zip(sources, files, strict=True):
        if not file.exists():
            write_looped(source, file, n)
    return files
