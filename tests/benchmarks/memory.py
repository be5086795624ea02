"""Whether memory stays flat over a recording ten times as long: `python tests/benchmarks/memory.py`.

Writes the bundled sample, played forth and back, into a session of its own, tracks it as `quadrille track` does, with
everything stored, and prints the resident memory every 100 frames. Linux only: it reads /proc.
"""

import argparse
import os
import tempfile
from collections.abc import Callable, Generator, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from looped_footage import forth_and_back

from app.cli.target import load_target
from app.cli.track import track
from app.runtime.malloc_trim import give_back_freed_memory
from app.runtime.progress import Reporter
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.evaluation.references import read_joints
from tracker.footage.camera_source import CameraSource
from tracker.footage.video import open_footage
from tracker.footage.video_writer import VideoWriter
from tracker.pipeline.given_pose import set_pose_at_joints
from tracker.pipeline.stored_run import TrackPlan
from tracker.session.session import Session, load_session, save_session

SAMPLE = Path(__file__).resolve().parents[2] / "sample_sessions" / "elbow_rotation"
EVERY = 100
"""Frames between two figures."""


def resident_mb() -> float:
    """Memory of this process that is in use now, MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def lengthened(source: CameraSource, folder: Path, fps: float, n: int) -> CameraSource:
    """Write footage of a camera, n frames long."""
    path = folder / f"{source.camera.name}.mp4"
    with closing(open_footage(source.footage, source.camera.name)) as footage:
        images = [footage.read(k) for k in range(footage.n_frames)]
    with VideoWriter(path, source.camera.size, fps) as writer:
        for k in forth_and_back(len(images), n):
            image = images[k]
            assert image is not None
            writer.write(image)
    return replace(source, footage=path, masks=None, offset=0)


def long_session(source: Path, folder: Path, times: int) -> Session:
    """Make a session of the same scene that lasts so many times as long."""
    session = load_session(source)
    n = times * session.n_frames
    cameras = [lengthened(c, folder, session.fps, n) for c in session.cameras]
    save_session(replace(session, folder=folder, n_frames=n, cameras=tuple(cameras)))
    return load_session(folder)


class Watch(Reporter):
    """Prints the memory in use while frames are tracked, and keeps the figures."""

    def __init__(self) -> None:
        super().__init__(silent=True)
        self.figures_mb: list[float] = []

    @contextmanager
    def over(self, total: int, what: str) -> Generator[Callable[[], None], None, None]:
        """Give a function to call after each frame."""
        done = 0

        def tick() -> None:
            nonlocal done
            done += 1
            if done % EVERY == 0:
                self.figures_mb.append(resident_mb())
                print(f"{done:5} of {total} frames: {self.figures_mb[-1]:.0f} MB", flush=True)

        yield tick


def slope_mb(figures_mb: Sequence[float]) -> float:
    """Growth over 1000 frames by a straight line through the later half, when caches are full, MB."""
    later = figures_mb[len(figures_mb) // 2 :]
    return float(np.polyfit(np.arange(len(later)) * EVERY, later, 1)[0]) * 1000


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--session", type=Path, default=SAMPLE, help="of one person")
    parser.add_argument("--joints", type=Path, default=SAMPLE / "truth.trc", help="to start from")
    parser.add_argument("--times", type=int, default=10, help="how many times as long")
    words = parser.parse_args()
    give_back_freed_memory()  # as the program does
    with tempfile.TemporaryDirectory() as name:
        session = long_session(words.session, Path(name), words.times)
        at = load_target(session.folder, None, several=False)
        set_pose_at_joints(at.session, at.people[0], 0, read_joints(words.joints, session.fps), fit_sizes=False)
        print(f"before the first frame: {resident_mb():.0f} MB")
        watch = Watch()
        found = track(at.session, TrackPlan(range(session.n_frames), at.people, TrackSettings()), watch)
        stored = session.annotations_path.stat().st_size
    print(f"{found['frames']} frames, {found['statuses']}; the store has {stored / found['frames']:.0f} bytes a frame")
    if len(watch.figures_mb) >= 4:
        print(f"growth over the later half: {slope_mb(watch.figures_mb):.1f} MB in 1000 frames")


if __name__ == "__main__":
    main()
