"""The row of `quadrille bench` about the audit: a whole run with it, beside the same run without."""

from collections.abc import Sequence
from dataclasses import replace

from app.bench.rows import Row, Yardstick
from app.bench.sample_frames import BenchFrame, pose_at
from tracker.evidence.observer import Observer
from tracker.footage.recording import Recording
from tracker.pipeline.methods import make_tracker
from tracker.pipeline.track_session import Leg, TrackSession
from tracker.pipeline.tracked_changes import RunChange, StoredPerson
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.subjects import Subjects
from tracker.tracking.tracker import TrackingRun

_FRAMES = range(5, 45)
_MUST = 4.0
"""Largest allowed processor time of an audited run, in runs without an audit."""


class _Nowhere:
    """Takes poses, and stores nothing."""

    def write(self, label: str, changes: Sequence[RunChange], edit: int | None) -> int | None:
        """See `PoseWriter.write`."""
        return edit


def audited_run(frame: BenchFrame, yardstick: Yardstick) -> Row:
    """One person in four views, from video to smoothed poses with their statuses."""
    session, model = frame.session, frame.model
    start = [[pose_at(frame.joints, model, _FRAMES[0], frame.values)]]

    def run(settings: TrackSettings) -> None:
        with Recording(session.cameras) as recording:
            observer = Observer(session.cameras, recording)
            leg = Leg(TrackingRun(observer, Subjects.of([model]), start, _FRAMES, session.fps))
            whole = TrackSession(make_tracker(settings), [leg], [StoredPerson("person", 1)], _Nowhere(), "bench")
            for step in whole.steps():
                whole.take(step)

    with_audit = TrackSettings()
    plain = yardstick.beside(lambda: run(replace(with_audit, audit=False)), 3)
    audited = yardstick.beside(lambda: run(with_audit), 3)
    must = _MUST * plain.work_us / plain.yardstick_us
    by_clock = audited.clock_us / plain.clock_us
    note = f"{audited.work_us / plain.work_us:.1f} times the run without; {by_clock:.1f} by the clock"
    return Row("audit", f"run with its audit, {len(_FRAMES)} frames, 4 views", *audited, must, note=note)
