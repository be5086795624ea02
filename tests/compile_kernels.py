"""Compile the kernels once, before tests in several processes would each do it at the same time.

`make test` does so while types are checked.
"""

from pathlib import Path

from app.bench_scenes import FRAME, read_crowd
from tracker.evidence import Observer
from tracker.recording import Recording
from tracker.track import track_chamfer
from tracker.track_settings import TrackSettings

SAMPLE = Path(__file__).resolve().parents[1] / "sample_sessions" / "tango"


def main() -> None:
    """Follow two people for a few frames, and search them: that needs nearly all there are."""
    crowd = read_crowd(SAMPLE, FRAME)
    for settings in (TrackSettings(), TrackSettings(estimate="search")):
        with Recording(crowd.session.cameras) as recording:
            observer = Observer(crowd.session.cameras, recording)
            for _ in track_chamfer(observer, crowd.models, crowd.values, range(FRAME, FRAME + 3), settings):
                pass


if __name__ == "__main__":
    main()
