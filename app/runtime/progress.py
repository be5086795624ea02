"""Show the progress of long work on a terminal."""

import time
from collections.abc import Callable, Generator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TaskProgressColumn, TextColumn
from rich.text import Text

from app.runtime.plain_output import printable

_OUTLIER, _COMPILING_S = 8.0, 1.0
"""An item compiled kernels, or waited for a disk, if it takes longer than this many times the upper quartile of all,
and longer than this many seconds. Items come in bursts, so that many take almost no time."""


class Pace:
    """The usual time of an item, without the first one and without outliers: those compile kernels.

    Tracking compiles at the first frame, and again where a search is needed for the first time.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        """Start the clock."""
        self._now, self._last, self._durations_s = now, now(), list[float]()

    def tick(self) -> None:
        """Note that an item is done."""
        now = self._now()
        self._durations_s.append(now - self._last)
        self._last = now

    @property
    def item_s(self) -> float | None:
        """Mean time of an item, s; None until two are done."""
        durations = sorted(self._durations_s[1:])
        if not durations:
            return None
        most = max(_COMPILING_S, _OUTLIER * durations[3 * (len(durations) - 1) // 4])
        usual = [d for d in durations if d <= most] or durations
        return max(1e-6, sum(usual) / len(usual))


class Reporter:
    """Progress as a bar on a terminal, as plain lines elsewhere, and none with `--json`."""

    def __init__(self, silent: bool = False) -> None:
        """Report on standard error unless silent."""
        self._console, self._silent = Console(stderr=True), silent

    def say(self, line: str) -> None:
        """Show a line."""
        if not self._silent:
            self._console.print(printable(line), soft_wrap=True, highlight=False, markup=False)

    @contextmanager
    def over(self, total: int, what: str) -> Generator[Callable[[], None], None, None]:
        """Yield a function to call after each of `total` items."""
        pace, what = Pace(), printable(what)
        if self._silent:
            yield lambda: None
        elif self._console.is_terminal:
            columns = (TextColumn(what, markup=False), BarColumn(), MofNCompleteColumn(), _PaceColumn(pace))
            with Progress(*columns, console=self._console) as bar:
                task = bar.add_task(what, total=total)

                def advance() -> None:
                    pace.tick()
                    bar.advance(task)

                yield advance
        else:
            done = 0

            def tick() -> None:
                nonlocal done
                done += 1
                pace.tick()
                if done % max(1, total // 10) == 0 or done == total:
                    line = f"{what}: {done} of {total}{pace_text(pace, total - done)}"
                    self._console.print(line, highlight=False, markup=False)

            yield tick

    @contextmanager
    def share(self, what: str, is_timed: bool = True) -> Generator[Callable[[float], None], None, None]:
        """Yield a function to call with the share of the work that is done, 0 to 1, after each step.

        Steps are of any size, so that the time left follows from the share, not from the number of calls. It is shown
        unless `is_timed` is False, where the share can jump.
        """
        began, shown = time.monotonic(), 0

        def left_text(share: float) -> str:
            return time_left_text(share, time.monotonic() - began) if is_timed else ""

        columns = (TextColumn(what), BarColumn(), TaskProgressColumn(), TextColumn("{task.fields[left]}"))
        if self._silent or not self._console.is_terminal:

            def line(share: float) -> None:
                nonlocal shown
                if self._silent or int(10 * share) <= shown:
                    return
                shown = int(10 * share)
                self._console.print(f"{what}: {100 * share:.0f}%{left_text(share)}", highlight=False)

            yield line
            return
        with Progress(*columns, console=self._console) as bar:
            task = bar.add_task(what, total=1.0, left="")

            def advance(share: float) -> None:
                bar.update(task, completed=share, left=left_text(share).removeprefix(", "))

            yield advance


def time_left_text(share: float, elapsed_s: float) -> str:
    """Return the time that the rest of the work will take, such as `, 12 s left`; empty if unknown.

    Args:
        share: of the work that is done, 0 to 1.
        elapsed_s: time that it took, s.
    """
    if not 0 < share < 1:
        return ""
    return f", {duration_text(elapsed_s * (1 - share) / share)} left"


def duration_text(seconds: float) -> str:
    """Return a time as text, such as `12 s`."""
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"


def pace_text(pace: Pace, left: int) -> str:
    """Return the rate, and the time that `left` items will take, such as `, 4.1/s, 12 s left`; empty if unknown."""
    if pace.item_s is None:
        return ""
    return f", {1 / pace.item_s:.1f}/s" + (f", {duration_text(left * pace.item_s)} left" if left else "")


class _PaceColumn(ProgressColumn):
    """Rate and time left."""

    def __init__(self, pace: Pace) -> None:
        super().__init__()
        self._pace = pace

    def render(self, task: Task) -> Text:
        """Text of the column."""
        return Text(pace_text(self._pace, round((task.total or 0) - task.completed)).removeprefix(", "))
