"""Imported observations: the sets of the session, what the views show of them, and their judgement."""

from dataclasses import dataclass

from app.state.progress import WorkState
from tracker.evaluation.judging.judge import Judgement
from tracker.interchange.observations.observed import ObservationSet
from tracker.interchange.observations.plans import ImportPlan, MaskPlan


@dataclass(frozen=True)
class ObservedSet:
    """One set in the session."""

    name: str
    format: str = ""
    people: tuple[str, ...] = ()
    is_in_space: bool = False
    """Whether it has joints in space, not key points in pictures."""
    frames: int = 0
    """Number of frames with points."""
    problem: str = ""
    """Why it cannot be read; empty if it can."""


@dataclass(frozen=True, eq=False)
class ObservationsState(WorkState):
    """Imported observations, and the work on them."""

    sets: tuple[ObservedSet, ...] = ()
    shown: ObservationSet | None = None
    """The set that the views show; None for none."""
    plan: ImportPlan | MaskPlan | None = None
    """An import that is previewed, and is not stored yet."""
    judged: str = ""
    """Name of the set of the judgements; empty without any."""
    judgements: tuple[Judgement, ...] = ()
    """One for each person of that set."""

    @property
    def drawn(self) -> ObservationSet | None:
        """The set that the views draw: the previewed one, else the shown one; beside masks to import, none is drawn."""
        return self.plan.observations if isinstance(self.plan, ImportPlan) else self.shown

    @property
    def drawn_judgements(self) -> tuple[Judgement, ...]:
        """The judgements of the set that the views draw."""
        return self.judgements if self.plan is None and self.shown and self.shown.name == self.judged else ()
