"""`quadrille acquire`: acquire the sizes of a person's body from the footage."""

from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from app.cli.arguments import OptionalName, OptionalPath, OptionalRange, SessionArg
from app.cli.json_output import format_json
from app.cli.target import Target, load_target, parse_frames
from app.runtime.progress import Reporter
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from tracker.acquisition.from_contours import AcquisitionSettings

_SHOWN = 12
"""Number of sizes that are listed."""
_TICKS = 100


@dataclass(frozen=True)
class AcquireArguments:
    """Arguments of `quadrille acquire`."""

    session: SessionArg
    """session folder."""
    method: Literal["contours"] = "contours"
    """contours fits all sizes to the contours of several frames in all views."""
    person: OptionalName = None
    """name; needed in a session of several people."""
    frames: OptionalRange = None
    """A:B, half open: the frames that may be used; all by default."""
    n_frames: int = 6
    """number of frames that the sizes are fitted to; they are chosen by what their poses show."""
    uncoupled: bool = False
    """let left and right differ."""
    out: OptionalPath = None
    """write the body to this TOML file too, for new --model NAME=FILE in another session."""
    dry_run: bool = False
    """show the sizes, but change nothing in the session."""
    json: bool = False
    """print one JSON object."""


def command(arguments: Annotated[AcquireArguments, tyro.conf.arg(name="")]) -> None:
    """Acquire the sizes of a person's body from the footage.

    The person needs a pose on one frame. Ctrl+C stops it and changes nothing; the page undoes it.
    """
    from tracker.acquisition.from_contours import AcquisitionSettings

    at = load_target(arguments.session, arguments.person, several=False)
    frames = parse_frames(arguments.frames, at.session)
    if arguments.n_frames < 1:
        raise TrackerError(f"expected --n-frames of at least 1, found {arguments.n_frames}; 5 to 10 are usual")
    settings = AcquisitionSettings(n_frames=arguments.n_frames, coupled=not arguments.uncoupled)
    found = acquire(at, frames, settings, Reporter(silent=arguments.json), store=not arguments.dry_run)
    if arguments.out is not None:
        from tracker.files import write_text_atomic

        write_text_atomic(arguments.out, found["model"])
    print(format_json(found) if arguments.json else _format(found, arguments))


def acquire(
    at: Target, frames: range, settings: "AcquisitionSettings", progress: Reporter, store: bool = True
) -> dict[str, Any]:
    """Acquire the body of one person and make it the present one, with keyframes fitted to it.

    Args:
        at: the session and the person.
        frames: the frames that may be used.
        settings: of the acquisition.
        progress: shows how far it is.
        store: whether the session is changed.

    Returns:
        The frames used, the cost before and after, each size with its standard deviation, and the model as TOML.

    Raises:
        TrackerError: the person has no pose on these frames, or the views show nothing of them.
    """
    from tracker.acquisition.size_report import size_changes
    from tracker.evidence.observer import Observer
    from tracker.footage.recording import Recording
    from tracker.formats.model_toml import format_model
    from tracker.pipeline.body_acquisition import acquire_body, store_body
    from tracker.session.lock import SessionLock
    from tracker.session.relink import require_files
    from tracker.store.annotation_store import AnnotationStore

    session, (person,) = at
    require_files(session)
    name, done = session.people[person].name, 0
    with SessionLock(session.folder), Recording(session.cameras) as recording:
        with progress.over(_TICKS, "acquiring") as tick:

            def report(stage: str, share: float) -> None:
                nonlocal done
                while done < int(share * _TICKS):
                    done += 1
                    tick()

            found = acquire_body(session, Observer(session.cameras, recording), person, frames, settings, report)
        changes = size_changes(found)
        if store:
            with closing(AnnotationStore(session.annotations_path)) as annotations:
                poses = dict(zip(found.frames, found.poses, strict=True))
                store_body(session, annotations, person, found.body, poses, f"acquire sizes of {name}")
    return {
        "person": name,
        "frames": list(found.frames),
        "cost_before_px": found.cost_before_px,
        "cost_after_px": found.cost_after_px,
        "height_m": found.body.height_m,
        "sizes": [c._asdict() for c in changes],
        "model": format_model(found.body),
    }


def _format(found: dict[str, Any], arguments: AcquireArguments) -> str:
    frames = ", ".join(map(str, found["frames"]))
    lines = [
        f"{found['person']}: {found['height_m']:.2f} m tall, from frames {frames}",
        f"cost {found['cost_before_px']:.2f} px before, {found['cost_after_px']:.2f} px with the acquired body",
        "sizes that changed most, cm (before, after, standard deviation):",
    ]
    for row in found["sizes"][:_SHOWN]:
        lines.append(
            f"  {row['name']:<34}{row['before_m'] * 100:6.1f} {row['after_m'] * 100:6.1f} {row['sigma_m'] * 100:6.1f}"
        )
    if arguments.dry_run:
        lines.append("nothing was stored (--dry-run)")
    else:
        lines.append("track again to use it: stored poses that are no keyframes keep the former body")
    return "\n".join(lines)
