"""The summary of a tracking run: as JSON, and for a terminal."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tracker.pipeline.stored_run import TrackPlan
    from tracker.pipeline.track_session import TrackSession
    from tracker.session.session import Session


def summarize(session: "Session", plan: "TrackPlan", run: "TrackSession", is_stopped: bool) -> dict[str, Any]:
    """Return a summary of a run.

    Args:
        session: the session.
        plan: what was tracked.
        run: its results.
        is_stopped: whether it was interrupted.

    Returns:
        `stopped_at` is the frame where it was interrupted, else None; `improved_backward` is the number of poses that
        the backward pass improved. `first_frame` is there where the run went out from a frame. `normal_matrices` has
        rank and conditioning by person, for methods that compute them.
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
        "improved_backward": run.n_improved,
        "people": [session.people[i].name for i in plan.people],
        "mean_cost_px": float(np.mean(costs)) if costs else None,
        "statuses": {session.people[i].name: dict(statuses[i]) for i in plan.people},
        "normal_matrices": _summarize_matrices(session, plan, run),
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
    if found["improved_backward"]:
        lines.append(f"the backward pass replaced {found['improved_backward']} poses of frames with lost people")
    if found["stopped_at"] is not None:
        lines.append(f"stopped before frame {found['stopped_at']}; run it again to resume")
    return "\n".join(lines)
