"""The plan of annotation, comments, the speed of annotators, and the next best click."""

from dataclasses import dataclass

from tracker.annotation.next_click import Click, Proposals
from tracker.annotation.plan import Comment, Task
from tracker.annotation.speed import Speed


@dataclass(frozen=True, eq=False)
class ProposedClick:
    """The search for the next best click, and what came of the last one."""

    number: int = 0
    """Number of the request that was answered last, from 1; 0 before the first."""
    running: bool = False
    message: str = ""
    """Why nothing could be proposed; else empty."""
    found: Proposals | None = None
    """The answer to the last request: at most one click."""
    after_mm: float | None = None
    """Expected error of the recording since the click was taken, mm; None before any pose has changed."""

    @property
    def click(self) -> Click | None:
        """The proposed click; None where none pays or none was asked for."""
        return self.found.clicks[0] if self.found is not None and self.found.clicks else None


@dataclass(frozen=True, eq=False)
class AnnotationState:
    """The plan as it is stored, and the next best click."""

    author: str = ""
    """Name of the author of decisions and comments."""
    tasks: tuple[Task, ...] = ()
    """Without withdrawn ones."""
    comments: tuple[Comment, ...] = ()
    """Earliest first, resolved ones too."""
    speeds: tuple[Speed, ...] = ()
    """Of each person; empty without a plan."""
    proposed: ProposedClick = ProposedClick()
