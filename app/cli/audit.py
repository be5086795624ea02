"""`quadrille audit`: assess stored poses by all frames and cameras together."""

from collections import Counter
from dataclasses import dataclass
from typing import Annotated, Any

import tyro

from app.cli.arguments import OptionalName, OptionalRange, SessionArg
from app.cli.target import Target, load_target, parse_frames
from app.runtime.json_output import format_json
from app.runtime.progress import Reporter

_LISTED = 8
"""Number of doubted frames that are listed for a person, the most doubtful first."""


@dataclass(frozen=True)
class AuditArguments:
    """Arguments of `quadrille audit`."""

    session: SessionArg
    """session folder."""
    person: OptionalName = None
    """name; all people who have poses by default."""
    frames: OptionalRange = None
    """A:B, half open; all by default."""
    replace: bool = False
    """let the likeliest poses take the place of the stored ones; by default these stay as they are."""
    json: bool = False
    """print one JSON object; docs/trackers.md lists its keys."""


def command(arguments: Annotated[AuditArguments, tyro.conf.arg(name="")]) -> None:
    """Assess stored poses: compare them with all others that they may be.

    Writes expected errors, statuses and reasons as one entry of the history. Poses may come from anywhere: tracked,
    interpolated, imported or set by hand; keyframes stay as they are. Ctrl+C stops it and changes nothing; the page
    undoes it.
    """
    at = load_target(arguments.session, arguments.person, several=True)
    frames = parse_frames(arguments.frames, at.session)
    found = audit(at, frames, arguments.replace, Reporter(silent=arguments.json))
    print(format_json(found) if arguments.json else _format(found))


def audit(at: Target, frames: range, replaces: bool, progress: Reporter) -> dict[str, Any]:
    """Audit the stored poses of people, and store their assessment.

    Returns:
        By name, `statuses` with the number of poses of each, and `doubts`: of each pose that is not good its `frame`,
        `status`, `probability_off` and `reason`, the most doubtful first.

    Raises:
        TrackerError: there is one camera, or no two frames in a row with poses.
    """
    import numpy as np

    from tracker.compute.progress import mapped, result_of
    from tracker.estimation.chamfer.settings import TrackSettings
    from tracker.estimation.tracking.pose_errors import probability_off
    from tracker.evidence.observer import Observer
    from tracker.footage.recording import Recording
    from tracker.pipeline.audit import AuditPlan, PoseAudit
    from tracker.session.lock import SessionLock
    from tracker.session.relink import require_files
    from tracker.session.store.annotation_store import AnnotationStore
    from tracker.session.store.records import PoseChange

    session, people = at
    require_files(session)
    with (
        SessionLock(session.folder),
        Recording(session.cameras) as recording,
        AnnotationStore(session.annotations_path) as store,
    ):
        people = tuple(i for i in people if store.frames(session.people[i].name)) or people
        plan = AuditPlan(frames, people, TrackSettings(), replaces)
        with progress.share("comparing poses") as advance:
            audit = PoseAudit(session, store, Observer(session.cameras, recording).at_nearest_times(), plan)
            rows = result_of(mapped(audit.steps(), advance))
        if rows:
            store.commit(f"audit frames {rows[0].frame}:{rows[-1].frame + 1}", rows, by_program=True)
    out: dict[str, Any] = {}
    for name in (session.people[i].name for i in people):
        changes = [(r.frame, r.pose if isinstance(r, PoseChange) else r) for r in rows if r.person == name]
        own = [(frame, assessed) for frame, assessed in changes if assessed is not None]
        off = {frame: float(probability_off(np.array(pose.limbs_lost)).max()) for frame, pose in own}
        doubts = [
            {"frame": frame, "status": pose.status, "probability_off": off[frame], "reason": pose.remark}
            for frame, pose in sorted(own, key=lambda x: -off[x[0]])
            if pose.status != "good"
        ]
        out[name] = {"statuses": dict(Counter(pose.status for _, pose in own)), "doubts": doubts}
    return out


def _format(found: dict[str, Any]) -> str:
    lines = []
    for name, person in found.items():
        counts = [f"{n} {status}" for status in ("good", "doubtful", "lost") if (n := person["statuses"].get(status))]
        lines.append(f"{name}: {', '.join(counts) or 'nothing is known of these keyframes'}")
        doubts = person["doubts"]
        lines += [
            f"  frame {d['frame']}: {d['reason']}, {100 * d['probability_off']:.0f}% chance that it is off"
            for d in doubts[:_LISTED]
        ]
        if len(doubts) > _LISTED:
            lines.append(f"  and {len(doubts) - _LISTED} more frames")
    return "\n".join(lines)
