"""Track people from the command line, with progress; the same command resumes an interrupted run."""

from collections.abc import Sequence
from contextlib import closing
from typing import Any

import numpy as np

from app.cli.actions import Target
from app.runtime.progress import Reporter
from tracker.compute.kernel_cache import compiled_mark
from tracker.evidence.observer import Observer
from tracker.footage.recording import Recording
from tracker.pipeline.stored_run import TrackTask, stored_run
from tracker.pipeline.track_session import TrackSession
from tracker.session.lock import SessionLock
from tracker.store.annotation_store import AnnotationStore
from tracker.tracking.tracker import TrackerSettings


def track(at: Target, frames: Sequence[int], settings: TrackerSettings, progress: Reporter) -> dict[str, Any]:
    """Track people and store their poses as one entry of the history.

    Keyframes and locked degrees of freedom stay as they are. Interrupted, it keeps what is done; the same call again
    goes on from there.

    Args:
        at: the session and whom to track.
        frames: in the order of tracking.
        settings: of the tracker, which name its method.
        progress: shows how far it is.

    Returns:
        A summary. `stopped_at` is the frame where it was interrupted, else None; `followed_back` is the number of poses
        that the second pass improved.

    Raises:
        SessionError: a person has no pose at or before the first frame.
    """
    session, stopped = at.session, False
    with (
        SessionLock(session.folder),
        closing(AnnotationStore(session.annotations_path)) as store,
        Recording(session.cameras) as recording,
        stored_run(session, store, Observer(session.cameras, recording), TrackTask(frames, at.people, settings)) as run,
    ):
        if not compiled_mark().exists():
            progress.say("kernels that are not compiled yet are compiled first, once: it may take a minute or two")
        try:
            _work(run, progress)
        except KeyboardInterrupt:
            stopped = True
    left, stopped_at = run.run.frames, run.next_frame
    if stopped_at is None:
        stopped_at = frames[-1] if run.visited is None else run.visited
    statuses, costs = run.status_counts(), [c for c in run.costs_px.values() if np.isfinite(c)]
    return {
        "frames": len(run.costs_px),
        "resumed_at": None if len(left) == len(frames) else left[0] if left else frames[-1],
        "stopped_at": stopped_at if stopped else None,
        "followed_back": run.n_improved,
        "people": [session.people[i].name for i in at.people],
        "mean_cost_px": float(np.mean(costs)) if costs else None,
        "statuses": {session.people[i].name: dict(statuses[i]) for i in at.people},
    }


def _work(run: TrackSession, progress: Reporter) -> None:
    """Do both passes and show the progress of each."""
    if run.run.frames:
        with progress.over(len(run.run.frames), "tracking") as tick:
            for estimate in run.first_pass():
                run.take(estimate)
                tick()
    run.save()
    steps = run.second_pass()
    first = next(steps, None)
    if first is None:
        return
    with progress.over(first.total, "tracking back") as tick:
        run.take(first)
        tick()
        for step in steps:
            run.take(step)
            tick()
