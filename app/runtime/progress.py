"""Show the progress of long work on a terminal."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text


class Reporter:
    """Progress as a bar on a terminal, as plain lines elsewhere, and none with `--json`."""

    def __init__(self, silent: bool = False) -> None:
        """Report on standard error unless silent."""
        self._console, self._silent = Console(stderr=True), silent

    def say(self, line: str) -> None:
        """Show a line."""
        if not self._silent:
            self._console.print(line, soft_wrap=True, highlight=False)

    @contextmanager
    def over(self, total: int, what: str) -> Iterator[Callable[[], None]]:
        """Yield a function to call after each of `total` items."""
        if self._silent:
            yield lambda: None
        elif self._console.is_terminal:
            columns = (TextColumn(what), BarColumn(), MofNCompleteColumn(), _RateColumn(), TimeRemainingColumn())
            with Progress(*columns, console=self._console) as bar:
                task = bar.add_task(what, total=total)
                yield lambda: bar.advance(task)
        else:
            done, began = 0, time.monotonic()

            def tick() -> None:
                nonlocal done
                done += 1
                if done % max(1, total // 10) == 0 or done == total:
                    rate = done / max(1e-6, time.monotonic() - began)
                    left = "" if done == total else f", {(total - done) / rate:.0f} s left"
                    self._console.print(f"{what}: {done} of {total}, {rate:.1f}/s{left}", highlight=False)

            yield tick


class _RateColumn(ProgressColumn):
    """Items per second."""

    def render(self, task: Task) -> Text:
        """Text of the column."""
        return Text("" if task.speed is None else f"{task.speed:.1f}/s")
