"""`quadrille next`: the frame, limb and view where a correction lowers the expected error of a recording most."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from app.cli.arguments import OptionalName, OptionalRange, SessionArg
from app.cli.target import Target, load_target, parse_frames
from app.runtime.json_output import format_json
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from tracker.annotation.next_click import Click


@dataclass(frozen=True)
class NextArguments:
    """Arguments of `quadrille next`."""

    session: SessionArg
    """session folder."""
    person: OptionalName = None
    """name; all people by default."""
    frames: OptionalRange = None
    """A:B, half open; all by default."""
    count: int = 1
    """number of proposals; each gains most after those before it."""
    json: bool = False
    """print one JSON object; docs/annotation.md lists its keys."""


def command(arguments: Annotated[NextArguments, tyro.conf.arg(name="")]) -> None:
    """Propose the frame, limb and view where a correction lowers the expected error of the recording most.

    The expected error follows from the stored error bars and the odds that a limb is lost. No image is read.
    """
    if arguments.count < 1:
        raise TrackerError(
            f"expected --count as a whole number from 1, found {arguments.count}; 5 lists five proposals"
        )
    at = load_target(arguments.session, arguments.person, several=True)
    found = next_clicks(at, parse_frames(arguments.frames, at.session), arguments.count)
    print(format_json(found) if arguments.json else _format(found))


def next_clicks(at: Target, frames: range, count: int) -> dict[str, Any]:
    """Return the best next action, None in its place where none pays, and what is expected of the recording.

    Raises:
        SessionError: nobody has a pose on these frames.
    """
    from tracker.annotation.expected_error import contradicted_keyframes
    from tracker.annotation.next_click import propose
    from tracker.session.store.annotation_store import AnnotationStore
    from tracker.session.store.stored_poses import read_stored_poses

    session = at.session
    poses = [
        read_stored_poses(session.annotations_path, p.name, p.model, frames) if i in at.people else {}
        for i, p in enumerate(session.people)
    ]
    contradicted: list[frozenset[int]] = []
    if session.annotations_path.exists():
        with AnnotationStore(session.annotations_path, read_only=True) as store:
            contradicted = [contradicted_keyframes(store, p.name) for p in session.people]
    found = propose(session, poses, count, contradicted=contradicted)
    clicks = [_record(c, session.people[c.person].name) for c in found.clicks]
    nothing: dict[str, Any] = dict.fromkeys(("frame", "person", "limb", "view", "views", "frames"))
    best = clicks[0] if clicks else {**nothing, "expected_gain_mm": 0.0, "reason": "nothing is left that pays"}
    return {
        **best,
        "expected_error_mm": found.error_mm,
        "interval_mm": list(found.interval_mm),
        "best_achievable_mm": found.best_mm,
        "next": clicks,
    }


def _record(click: "Click", person: str) -> dict[str, Any]:
    return {
        "frame": click.frame,
        "person": person,
        "limb": click.limb,
        "view": click.views[0],
        "views": list(click.views),
        "frames": list(click.frames),
        "expected_gain_mm": click.gain_mm,
        "reason": click.reason,
    }


def _format(found: dict[str, Any]) -> str:
    low, high = found["interval_mm"]
    error = f"expected error {found['expected_error_mm']:.1f} mm ({low:.1f} to {high:.1f}, 90%)"
    lines = [f"{error}; {found['best_achievable_mm']:.1f} mm if every limb were corrected where that pays"]
    if not found["next"]:
        return f"nothing is left that pays: {lines[0]}"
    people = {c["person"] for c in found["next"]}
    for c in found["next"]:
        who = f"{c['person']}, " if len(people) > 1 else ""
        lines.append(f"frame {c['frame']}: {who}{c['reason']}; gains {c['expected_gain_mm']:.2f} mm")
    return "\n".join(lines)
