import gc
import threading
import weakref
from contextlib import contextmanager

import pytest
from gestures import wait_for

from app.runtime import jobs
from app.runtime.jobs import Job, LatestWinsWorker
from tracker.errors import TrackerError


class Watched:
    """A job over given steps, and what it reported."""

    def __init__(self, steps):
        self.done, self.paused, self.ended = [], 0, []
        self.job = Job(lambda: steps, lambda step, _: self.done.append(step), self.ended.append, self._paused)

    def _paused(self):
        self.paused += 1


def test_a_job_is_stepped_run_and_ends_once():
    watched = Watched(iter(range(5)))
    watched.job.step()
    wait_for(lambda: watched.paused == 1)
    assert watched.done == [0]
    watched.job.run()
    wait_for(lambda: watched.ended)
    assert (watched.done, watched.ended, watched.job.running) == ([0, 1, 2, 3, 4], [None], False)
    watched.job.run()
    assert not watched.job.running


def test_a_stopped_job_stands_and_goes_on():
    go = threading.Semaphore(0)

    def steps():
        for i in range(4):
            go.acquire()
            yield i

    watched = Watched(steps())
    watched.job.run()
    go.release()
    wait_for(lambda: watched.done == [0])
    threading.Timer(0.1, go.release).start()
    watched.job.stop()
    assert (watched.done, watched.paused) == ([0, 1], 1)
    watched.job.run()
    go.release(2)
    wait_for(lambda: len(watched.done) == 4)
    watched.job.stop()


class Clock:
    """Time that goes by only where it is slept."""

    def __init__(self):
        self.now, self.rests = 100.0, []

    def monotonic(self):
        return self.now

    def perf_counter(self):
        return self.now

    def wait(self, seconds):
        self.rests.append(seconds)
        self.now += seconds

    def clear(self):
        pass


def test_a_pace_counts_from_step_to_step_not_from_the_end_of_one(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(jobs, "time", clock)

    def steps():
        for seconds in (0.25, 0.5, 1.5, 0.25, 9.0, 0.25, 0.25):
            clock.now += seconds
            yield clock.now

    watched = Watched(steps())
    watched.job.pace(1.0)
    watched.job._wake = clock
    watched.job.run()
    wait_for(lambda: watched.ended)
    # What took too long is made up for, by one step at most.
    assert [t - 100.0 for t in watched.done] == [0.25, 1.5, 3.5, 3.75, 13.0, 13.25, 13.5]
    assert clock.rests == [0.75, 0.5, 0.25, 0.5]


def test_a_step_that_does_not_end_is_said():
    begun, go = threading.Event(), threading.Event()

    def steps():
        begun.set()
        go.wait()
        yield 1

    watched = Watched(steps())
    watched.job.run()
    begun.wait()
    with pytest.raises(TrackerError, match=r"still at work.* try again"):
        watched.job.stop(timeout=0.05)  # or this would wait for `go` for ever
    go.set()
    wait_for(lambda: watched.paused == 1)  # it stopped as soon as it could


def test_a_job_that_fails_hands_its_error_on():
    def steps():
        yield 1
        raise RuntimeError("no light")

    watched = Watched(steps())
    watched.job.run()
    wait_for(lambda: watched.ended)
    assert watched.done == [1]
    assert str(watched.ended[0]) == "no light"


@contextmanager
def no_collector():
    """Only what nobody refers to is freed."""
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


@pytest.mark.slow
@pytest.mark.parametrize("ends_by", ["discarding a paused job", "discarding a running job", "the last step"])
def test_a_job_that_is_over_frees_what_its_steps_held(ends_by):
    images, go = [], threading.Semaphore(0)

    def steps():
        held = Images()
        images.append(weakref.ref(held))
        yield 1
        go.acquire()
        yield held.number

    class Images:
        number = 2

    with no_collector():
        watched = Watched(steps())
        watched.job.step()
        wait_for(lambda: watched.paused)
        if ends_by != "discarding a paused job":
            watched.job.run()
        if ends_by == "discarding a running job":
            watched.job.discard()
        go.release()
        if ends_by.startswith("discarding"):
            watched.job.discard()
        wait_for(lambda: images[0]() is None and watched.job.ended)
        assert watched.ended == [] if ends_by.startswith("discarding") else len(watched.ended) == 1
        watched.job.run()
        assert not watched.job.running


class View:
    """A view that is subscribed to something and holds its worker, as those of a session do."""

    def __init__(self, name):
        self.shown, self.is_shown = [], threading.Event()
        self.worker = LatestWinsWorker(self.show, name)
        self.subscribers = [self.worker.offer]

    def show(self, value):
        self.shown.append(value)
        self.is_shown.set()


def test_the_thread_of_a_worker_ends_once_its_view_is_dropped():
    view = View("view of a closed session")
    view.worker.offer(1)
    assert view.is_shown.wait(5)
    (thread,) = (t for t in threading.enumerate() if t.name == "view of a closed session")
    del view
    gc.collect()
    thread.join(5)
    assert not thread.is_alive()
