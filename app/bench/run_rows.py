"""The row of `quadrille bench` about the estimate of all frames of a run, beside the first pass of the same run."""

from collections.abc import Sequence

from app.bench.rows import Row, Yardstick
from app.bench.sample_frames import BenchFrame, pose_at
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.tracking.tracker import Subjects, TrackingRun
from tracker.evidence.observer import open_observer
from tracker.pipeline.methods import make_tracker
from tracker.pipeline.track_session import Leg, TrackSession
from tracker.pipeline.tracked_changes import RunChange, StoredPerson

_FRAMES = range(5, 45)
_MUST = 6.0
"""Largest allowed processor time of a whole run, in first passes."""


class _Nowhere:
    """Takes poses, and stores nothing."""

    def write(self, label: str, changes: Sequence[RunChange], edit: int | None) -> int | None:
        """See `PoseWriter.write`."""
        return edit


def whole_run(frame: BenchFrame, yardstick: Yardstick) -> Row:
    """One person in four views, from video to estimated poses with their statuses."""
    session, model = frame.session, frame.model
    start = [[pose_at(frame.joints, model, _FRAMES[0], frame.values)]]

    def run(settings: TrackSettings) -> None:
        with open_observer(session.cameras) as observer:
            leg = Leg(TrackingRun(observer, Subjects.of([model]), start, _FRAMES, session.fps))
            whole = TrackSession(make_tracker(settings), [leg], [StoredPerson("person", 1)], _Nowhere(), "bench")
            for step in whole.steps():
                whole.take(step)

    first = yardstick.beside(lambda: run(TrackSettings(whole_run=False)), 3)
    whole = yardstick.beside(lambda: run(TrackSettings()), 3)
    must, by_clock = _MUST * first.work_us / first.yardstick_us, whole.clock_us / first.clock_us
    note = f"{whole.work_us / first.work_us:.1f} times the first pass; {by_clock:.1f} by the clock"
    return Row("whole_run", f"whole run, {len(_FRAMES)} frames, 4 views", *whole, must, note=note)
