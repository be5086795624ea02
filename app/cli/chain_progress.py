"""Show the progress of a chain on a terminal."""

from collections.abc import Callable
from contextlib import ExitStack
from types import TracebackType
from typing import TYPE_CHECKING

from app.runtime.progress import Reporter
from tracker.compute.kernel_cache import compiled_mark
from tracker.pipeline.run_repair import RepairStep
from tracker.pipeline.track_session import AuditStep
from tracker.tracking.estimate import BackwardStep, PoseEstimate

if TYPE_CHECKING:
    from tracker.initialization.first_pose import FirstPoses
    from tracker.pipeline.track_session import Step, TrackSession

_PASSES = {
    BackwardStep: "tracking back", AuditStep: "checking each camera", RepairStep: "comparing with the run's colours"
}  # fmt: skip
"""Passes after the first, by their steps."""


class ChainProgress:
    """The sink of a chain: one bar for people and sizes, one for each pass of the run, and a line for each sentence."""

    def __init__(self, progress: Reporter) -> None:
        """Show nothing yet.

        Args:
            progress: shows bars and lines.
        """
        self._progress, self._bar, self._stage = progress, ExitStack(), ""
        self._advance: Callable[[float], None] = lambda share: None
        self._tick: Callable[[], None] = lambda: None

    def __enter__(self) -> "ChainProgress":
        """Begin."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """End the last bar."""
        self._bar.close()

    def report(self, stage: str, share: float, text: str = "", /) -> None:
        """See `Sink.report`."""
        if not self._stage:
            if not compiled_mark().exists():
                self._progress.say("kernels that are not compiled yet are compiled first: it may take a minute or two")
            if share < 1:
                self._advance = self._bar.enter_context(self._progress.share("before tracking"))
        if stage != self._stage and share < 1:
            self._progress.say(stage)
        self._stage = stage
        if text:
            self._progress.say(text)
        self._advance(share)

    def show(self, frame: int, found: "FirstPoses | None") -> None:
        """See `Sink.show`; a terminal shows no poses."""

    def take(self, run: "TrackSession", step: "Step") -> None:
        """See `Sink.take`."""
        if isinstance(step, PoseEstimate):
            if len(run.costs_px) == 1:
                self._count(len(run.frames), "tracking")
            self._tick()
        elif isinstance(step, BackwardStep | AuditStep | RepairStep):
            if step.done == 1:
                self._count(step.total, _PASSES[type(step)])
            self._tick()

    def _count(self, total: int, what: str) -> None:
        """Begin another bar."""
        self._bar.close()
        self._advance = lambda share: None
        self._tick = self._bar.enter_context(self._progress.over(total, what))
