"""How long work reports its progress."""

import time
from collections.abc import Callable, Generator
from typing import Protocol, TypeVar

S = TypeVar("S")
T = TypeVar("T")
U = TypeVar("U")


class Report(Protocol):
    """Receives the progress of long work. Raise to end the work."""

    def __call__(self, stage: str, share: float, text: str = "", /) -> None:
        """Receive one step.

        Args:
            stage: the kind of work, as text for the user.
            share: of the work that is done, 0 to 1.
            text: a sentence on a result; empty without one.
        """


def part_of(report: Report, begin: float, end: float, stage: str = "") -> Report:
    """Return what a part of the work reports to.

    Args:
        report: receives the progress of the whole.
        begin: share of the whole that is done before the part, 0 to 1.
        end: the same after it.
        stage: kind of work of the whole part; that of each step if empty.
    """

    def reported(own: str, share: float, text: str = "", /) -> None:
        report(stage or own, begin + (end - begin) * share, text)

    return reported


def stages(report: Report, *names: str) -> list[Callable[[float], None]]:
    """Return what each stage of some work gives its share to, 0 to 1. All stages take the same part of the whole."""

    def stage(i: int, name: str) -> Callable[[float], None]:
        return lambda share: report(name, (i + share) / len(names))

    return [stage(i, name) for i, name in enumerate(names)]


def unreported(stage: str, share: float, text: str = "", /) -> None:
    """Show no progress."""


class PartPace:
    """The longest time of a part of some work, learned from the parts before it. Some are done at the same time."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        """Know nothing yet; `now` is a clock, s."""
        self._now, self._durations_s = now, list[float]()
        self.begin()

    def begin(self) -> None:
        """Note that one or several parts begin."""
        self._began = self._now()

    def end(self, n_parts: int) -> None:
        """Note that they are done."""
        self._durations_s.append((self._now() - self._began) / n_parts)
        self.begin()

    def left_s(self, n_left: int) -> float | None:
        """Return the time that further parts take if each is as slow as the slowest, s; None before any is done.

        Args:
            n_left: number of these parts, with those that began.
        """
        if not self._durations_s:
            return None
        return max(0.0, n_left * max(self._durations_s) - (self._now() - self._began))


def result_of(steps: Generator[object, None, T]) -> T:
    """Do all steps of some work; return its result."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            result: T = end.value
            return result


def mapped(steps: Generator[S, None, T], shown: Callable[[S], U]) -> Generator[U, None, T]:
    """Return the same work with what each step shows in its place."""
    while True:
        try:
            yield shown(next(steps))
        except StopIteration as end:
            result: T = end.value
            return result
