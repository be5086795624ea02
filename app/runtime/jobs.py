"""Run long work in a worker thread, step by step or to the end; it can be stopped after any step."""

import logging
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Generic, TypeVar

from tracker.errors import TrackerError

_LOG = logging.getLogger(__name__)
_POOL = ThreadPoolExecutor(2, thread_name_prefix="job")

T = TypeVar("T")


class StoppedError(Exception):
    """The user has stopped the work, or nobody waits for it any more."""


class Job(Generic[T]):
    """Exhausts a generator of steps in the background.

    `on_step(step, seconds)` is called in the worker with each step and the time worked so far. `on_end(error)` is
    called once, when the generator is exhausted or has raised. A stopped job is paused: it can be continued. A job that
    has ended or is discarded drops its generator and callbacks: they and their owner refer to one another, so that what
    they hold, tens of megabytes of images, would stay until the interpreter searches for such cycles, minutes later.
    """

    def __init__(
        self,
        start: Callable[[], Iterator[T]],
        on_step: Callable[[T, float], None],
        on_end: Callable[[Exception | None], None],
        on_pause: Callable[[], None],
    ) -> None:
        """Prepare the job; it does not start yet.

        Args:
            start: makes the generator, in the worker.
            on_step: see above.
            on_end: see above.
            on_pause: called in the worker when the job pauses before its end.
        """
        self._start, self._on_step, self._on_end, self._on_pause = start, on_step, on_end, on_pause
        self._steps: Iterator[T] | None = None
        self._stop = threading.Event()
        self._rest_s = 0.0
        self._wake = threading.Event()
        self._future: Future[None] | None = None
        self._seconds = 0.0
        self.running = False
        """Whether the worker is active; already false when `on_pause` and `on_end` are called."""
        self.ended = False
        """Whether there are no more steps."""

    def step(self) -> None:
        """Do one step in the background; no effect on a running job."""
        self._launch(lambda _: True)

    def run(self, until: Callable[[T], bool] = lambda _: False) -> None:
        """Continue in the background to a step that `until` accepts, or to the end; no effect on a running job."""
        self._launch(until)

    def pace(self, rest_s: float) -> None:
        """Set the time between two steps, seconds, so that the user can watch; also changes the present rest."""
        self._rest_s = rest_s
        self._wake.set()

    def stop(self, timeout: float = 30.0) -> None:
        """Stop after the current step, and wait for it. The caller must not hold a lock that `on_step` takes.

        Raises:
            TrackerError: the step takes longer than `timeout`, s.
        """
        self._stop.set()
        self._wake.set()
        try:
            if self._future is not None:
                self._future.exception(timeout)
        except TimeoutError as error:
            raise TrackerError(
                f"expected the current step to end within {timeout:g} s, found it still at work, as may happen the "
                "first time; it stops as soon as it can, so wait and try again"
            ) from error

    def discard(self) -> None:
        """End without further steps or calls, and drop what the generator holds; after the current step if it runs."""
        self.ended = True
        self._stop.set()
        self._wake.set()
        if not self.running:
            self._release()

    def _release(self) -> None:
        self._start, self._steps = lambda: iter(()), None
        self._on_step, self._on_end, self._on_pause = (lambda *_: None), (lambda _: None), (lambda: None)

    def _launch(self, until: Callable[[T], bool]) -> None:
        if not self.running and not self.ended:
            self._stop.clear()
            self.running = True
            self._future = _POOL.submit(self._work, until)

    def _work(self, until: Callable[[T], bool]) -> None:
        done, due = False, time.monotonic()
        try:
            while not self._stop.is_set() and not done:
                began = time.perf_counter()
                if self._steps is None:
                    self._steps = self._start()
                step = next(self._steps, None)
                self._seconds += time.perf_counter() - began
                if step is None:
                    self._end(None)
                    return
                self._on_step(step, self._seconds)
                done = until(step)
                if not done:
                    due = self._rest(due)
            self.running = False
            self._on_pause()
            if self.ended:  # discarded during the step
                self._release()
        except Exception as error:
            _LOG.exception("a job failed")
            self._end(error)

    def _end(self, error: Exception | None) -> None:
        on_end = self._on_end
        self.ended, self.running = True, False
        self._release()
        on_end(error)

    def _rest(self, due: float) -> float:
        """Rest until the next step is due; returns that time.

        Slow steps are compensated by shorter rests, by one step at most.

        Args:
            due: when the last step was due, s of the monotonic clock.
        """
        while not self._stop.is_set() and (left := due + self._rest_s - time.monotonic()) > 0:
            self._wake.wait(left)
            self._wake.clear()
        return max(due + self._rest_s, time.monotonic() - self._rest_s)


class _Waiting(Generic[T]):
    """Values that wait for the thread of a worker, which does not keep the worker alive meanwhile."""

    def __init__(self) -> None:
        self._values: dict[object, T] = {}
        self._condition = threading.Condition()
        self._closed = False

    def put(self, value: T, key: object) -> None:
        with self._condition:
            self._values[key] = value
            self._condition.notify()

    def take(self) -> tuple[T] | None:
        """Return the value that waits for longest, after a while; None once it is closed."""
        with self._condition:
            self._condition.wait_for(lambda: self._values or self._closed)
            return None if self._closed else (self._values.pop(next(iter(self._values))),)

    def close(self) -> None:
        with self._condition:
            self._closed = True
            self._condition.notify()


class LatestWinsWorker(Generic[T]):
    """Passes values to a slow consumer in its own thread; a newer value replaces a waiting one of the same key.

    The thread ends with `close`, or once nothing refers to the worker, as when the views of a session are dropped.
    """

    def __init__(self, consume: Callable[[T], None], name: str, rest_s: float = 0.0) -> None:
        """Start the thread.

        Args:
            consume: called with one value at a time.
            name: of the thread.
            rest_s: minimum time between the end of one call and the start of the next, seconds.
        """
        self._consume, self._rest_s = consume, rest_s
        self._waiting = _Waiting[T]()
        weakref.finalize(self, self._waiting.close)
        threading.Thread(target=_work, args=(weakref.ref(self), self._waiting), name=name, daemon=True).start()

    def offer(self, value: T, key: object = None) -> None:
        """Queue a value, in place of a waiting one of the same key."""
        self._waiting.put(value, key)

    def close(self) -> None:
        """End the thread; waiting values are discarded."""
        self._waiting.close()

    def pass_on(self, value: T) -> float:
        """Call the consumer, in the worker's thread; return the time to rest, seconds."""
        try:
            self._consume(value)
        except Exception:
            _LOG.exception("a view failed")
        return self._rest_s


def _work(worker: "weakref.ref[LatestWinsWorker[T]]", waiting: _Waiting[T]) -> None:
    while (taken := waiting.take()) and (alive := worker()):
        rest_s = alive.pass_on(*taken)
        del taken, alive
        time.sleep(rest_s)
