"""The progress of a chain on a terminal, and the summary of its tracking run: as JSON, and for people."""

from collections.abc import Callable
from contextlib import ExitStack
from types import TracebackType
from typing import TYPE_CHECKING, Any

from app.remedies import command_line_text
from app.runtime.progress import Reporter, duration_text
from tracker.compute.kernel_cache import compiled_mark
from tracker.errors import Remedy
from tracker.estimation.tracking.tracker import BackwardStep, PoseEstimate
from tracker.pipeline.find_people import FINDING
from tracker.pipeline.track_session import EstimateStep

if TYPE_CHECKING:
    from tracker.estimation.initialization.frame_trials import Trying
    from tracker.pipeline.stored_run import TrackPlan
    from tracker.pipeline.track_session import Step, TrackSession
    from tracker.session.session import Session

_ESTIMATING = "estimating all frames together"


class ChainProgress:
    """The sink of a chain: a bar for each step and each pass of the run, and a line for each frame and sentence."""

    def __init__(self, progress: Reporter) -> None:
        """Show nothing yet.

        Args:
            progress: shows bars and lines.
        """
        self._progress, self._bar, self._stage, self._tried = progress, ExitStack(), "", ""
        self._advance: Callable[[float], None] = lambda share: None
        self._tick: Callable[[], None] = lambda: None
        self._n_backward: int | None = None

    def __enter__(self) -> "ChainProgress":
        """Begin."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """End the last bar."""
        self._bar.close()

    def report(self, stage: str, share: float, text: str = "", /) -> None:
        """See `Sink.report`."""
        if not self._stage and not compiled_mark().exists():
            self._progress.say("kernels that are not compiled yet are compiled first: it may take a minute or two")
        if stage != self._stage and share < 1:
            self._bar.close()
            is_timed = stage not in (FINDING, _ESTIMATING)
            self._advance = self._bar.enter_context(self._progress.share(stage, is_timed))
        self._stage = stage
        if text:
            self._progress.say(text)
        self._advance(share)

    def show(self, trying: "Trying") -> None:
        """See `Sink.show`; a terminal shows no poses."""
        if trying.text == self._tried or (trying.frame is not None and trying.n_figures is None):
            return
        self._tried = trying.text
        left = "" if trying.left_s is None else f", at most {duration_text(trying.left_s)} left"
        self._progress.say(trying.text + left)

    def take(self, run: "TrackSession", step: "Step") -> None:
        """See `Sink.take`."""
        if isinstance(step, PoseEstimate):
            if len(run.costs_px) == 1:
                self._count(len(run.frames), "tracking")
            self._tick()
        elif isinstance(step, BackwardStep):
            if self._n_backward != step.total:
                self._n_backward = step.total
                self._count(step.total - step.done + 1, "tracking backward")
            self._tick()
        elif isinstance(step, EstimateStep):
            self.report(_ESTIMATING, step.done / step.total)

    def _count(self, total: int, what: str) -> None:
        """Begin another bar."""
        self._bar.close()
        self._advance = lambda share: None
        self._tick = self._bar.enter_context(self._progress.over(total, what))


def summarize(session: "Session", plan: "TrackPlan", run: "TrackSession", is_stopped: bool) -> dict[str, Any]:
    """Return a summary of a run.

    Args:
        session: the session.
        plan: what was tracked.
        run: its results.
        is_stopped: whether it was interrupted.

    Returns:
        `stopped_at` is the frame where it was interrupted, else None; `moved_by_estimate` is the number of poses with a
        limb elsewhere than where the first pass had it. `contradiction` is a sentence on a camera that seems off, else
        None. `first_frame` is there where the run went out from a frame. `normal_matrices` has rank and conditioning by
        person, for methods that compute them.
    """
    import numpy as np

    planned, left, stopped_at = [k for leg in plan.legs for k in leg if k != plan.start], run.frames, run.next_frame
    if stopped_at is None:
        stopped_at = plan.legs[-1][-1] if run.visited is None else run.visited
    statuses, costs = run.status_counts(), [c for c in run.costs_px.values() if np.isfinite(c)]
    return {
        "frames": len(run.costs_px),
        "resumed_at": None if len(left) == len(planned) else left[0] if left else planned[-1],
        "stopped_at": stopped_at if is_stopped else None,
        "moved_by_estimate": run.n_moved,
        "people": [session.people[i].name for i in plan.people],
        "mean_cost_px": float(np.mean(costs)) if costs else None,
        "statuses": {session.people[i].name: dict(statuses[i]) for i in plan.people},
        "normal_matrices": _summarize_matrices(session, plan, run),
        "contradiction": run.contradiction or None,
        **({} if plan.start is None else {"first_frame": plan.start}),
    }


def _summarize_matrices(session: "Session", plan: "TrackPlan", run: "TrackSession") -> dict[str, Any]:
    """Return the lowest rank of the normal matrix and its median condition number, by person (KRH08 Sect. 5.4)."""
    import numpy as np

    out = dict[str, Any]()
    for i in plan.people:
        found = [m for of_frame in run.normal_matrices.values() if (m := of_frame[i]) is not None]
        if found:
            lowest = min(found, key=lambda m: m.rank - m.n_dofs)
            condition = float(np.median([m.condition for m in found]))
            out[session.people[i].name] = {
                "lowest_rank": lowest.rank,
                "n_dofs": lowest.n_dofs,
                "median_condition": condition if np.isfinite(condition) else None,
            }
    return out


def format_summary(found: dict[str, Any]) -> str:
    """Format a summary for a terminal."""
    resumed = "" if found["resumed_at"] is None else f", resumed at frame {found['resumed_at']}"
    lines = [f"tracked {', '.join(found['people'])} over {found['frames']} frames{resumed}"]
    if found["mean_cost_px"] is not None:
        lines[0] += f", mean cost {found['mean_cost_px']:.2f} px"
    for name, statuses in found["statuses"].items():
        counts = [f"{statuses[s]} {s}" for s in ("good", "doubtful", "lost") if statuses.get(s)]
        lines.append(f"{name}: {', '.join(counts)}")
    for name, matrix in found["normal_matrices"].items():
        condition = "unbounded" if matrix["median_condition"] is None else f"{matrix['median_condition']:.1e}"
        lines.append(
            f"{name}: normal matrix of rank {matrix['lowest_rank']} of {matrix['n_dofs']} or more, "
            f"condition number {condition} in the median"
        )
    if n_moved := found["moved_by_estimate"]:
        lines.append(f"all frames together moved a limb in {n_moved} pose{'' if n_moved == 1 else 's'}")
    if found["contradiction"] is not None:
        lines.append(command_line_text(found["contradiction"], Remedy("check_cameras")))
    if found["stopped_at"] is not None:
        lines.append(f"stopped before frame {found['stopped_at']}; run it again to resume")
    return "\n".join(lines)


def format_stretches(found: dict[str, Any]) -> str:
    """Format the stretches between keyframes that were tracked, for people."""
    if not found["stretches"]:
        return "nothing to track: all poses between keyframes were tracked from them as they are now"
    lines = [f"frames {s['first']} to {s['last']}: {', '.join(s['people'])}" for s in found["stretches"]]
    return "\n".join([*lines, *map(format_summary, found["runs"])])
