"""A batch whose tasks write a line each, in this process and in one to be killed."""

import sys
import time
from pathlib import Path

from tracker.api.work import Tracked
from tracker.batch.manifest import Manifest
from tracker.batch.plan import BatchPlan, PlannedRecording, Settings
from tracker.batch.worker import Done, work
from tracker.errors import TrackerError


def make_batch(folder, n, failing=()):
    """A batch of n recordings; those of the given numbers fail."""
    names = [f"r{i:03d}{' fails' if i in failing else ''}" for i in range(n)]
    recordings = tuple(PlannedRecording(name, str(folder / name), Settings()) for name in names)
    return Manifest.create(BatchPlan(folder / "plan.toml", recordings), folder)


def write_line(task, folder, progress, seconds=0.0):
    """Do a task: a line in a file of its own. It takes some time, and then fails if its name says so."""
    progress("working", 0.0)
    time.sleep(seconds)
    if task.recording.name.endswith("fails"):
        raise TrackerError("expected a recording that works, found none; leave it out")
    with (folder / f"{task.key}.txt").open("a") as file:
        file.write("done\n")
    progress("working", 1.0)
    return Done(Tracked(1, {"ann": {"good": 1}}, 1.0, 0, ""), ())


if __name__ == "__main__":
    work(Path(sys.argv[1]), do=lambda task, folder, progress: write_line(task, folder, progress, 0.02))
