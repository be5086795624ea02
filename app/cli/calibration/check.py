"""`quadrille check`: find the cameras whose calibration the contours of tracked people contradict, and correct them."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from app.cli.arguments import OptionalRange, SessionArg
from app.cli.target import parse_frames
from app.remedies import command_line_text
from app.runtime.json_output import format_json
from app.runtime.progress import Reporter
from tracker.errors import Remedy, TrackerError

if TYPE_CHECKING:
    from tracker.calibration.check.diagnosis import CameraFinding
    from tracker.calibration.check.single_frames import FrameScore
    from tracker.pipeline.calibration_check import CalibrationCheck
    from tracker.session.session import Session


@dataclass(frozen=True)
class CheckArguments:
    """Arguments of `quadrille check`."""

    session: SessionArg
    """session folder."""
    frames: OptionalRange = None
    """A:B, half open; all by default."""
    max_frames: int = 20
    """largest number of frames of diverse poses that are used: 3 find the camera, 20 measure its correction."""
    acquire: bool = False
    """acquire the shape of people who have that of a preset, for the check alone; nothing of it is stored."""
    apply: bool = False
    """correct the cameras that are named, if other frames confirm it; the page undoes it."""
    json: bool = False
    """print one JSON object; docs/log/calibration.md lists its keys."""


def command(arguments: Annotated[CheckArguments, tyro.conf.arg(name="")]) -> None:
    """Find the cameras whose calibration the contours of tracked people contradict.

    Needs poses, tracked with the present calibration. Says which camera is off, by how much, since which frame, and
    the correction with its standard deviation. Ctrl+C stops it and changes nothing.
    """
    from tracker.session.session import load_session

    session = load_session(arguments.session)
    frames = parse_frames(arguments.frames, session)
    if arguments.max_frames < 3:
        raise TrackerError(f"expected --max-frames as a number from 3, found {arguments.max_frames}")
    options = arguments.acquire, arguments.apply
    found = check(session, frames, arguments.max_frames, options, Reporter(silent=arguments.json))
    print(format_json(found) if arguments.json else _format(found))


def check(session: "Session", frames: range, n: int, options: tuple[bool, bool], progress: Reporter) -> dict[str, Any]:
    """Check the cameras of a session; acquire shapes for it, and correct the cameras, if asked for either.

    Returns:
        The object that `--json` prints.

    Raises:
        TrackerError: there are fewer than two cameras, or too few frames with poses; or the correction does not hold on
            other frames.
    """
    from tracker.evidence.observer import open_observer
    from tracker.pipeline.body_acquisition import generic_doubt, with_acquired_bodies
    from tracker.pipeline.calibration_check import check_calibration, held_out_scores
    from tracker.pipeline.posed_recording import PosedRecording
    from tracker.session.relink import require_files

    require_files(session)
    acquires, applies = options
    with open_observer(session.cameras) as observer, progress.share("checking the cameras") as advance:

        def report(stage: str, share: float, text: str = "", /) -> None:
            advance(share)

        posed = PosedRecording.of_session(session, observer.at_nearest_times())
        if acquires:
            posed = with_acquired_bodies(posed, session, report)
        found = check_calibration(posed, frames, n, report)
        scores = held_out_scores(posed, found, n, report) if found.named else []
    doubt = "" if acquires else generic_doubt(session)
    notes = (command_line_text(doubt, Remedy("acquire_first")),) if doubt else ()
    found = replace(found, notes=(*notes, *found.notes))
    out = _as_json(found, scores) | {"clocks": clock_notes(session, found) if found.named else []}
    if applies:
        out["applied"] = list(found.named)
        out["outdated_sizes"] = _apply(session, found, scores) if found.named else []
    return out


def clock_notes(session: "Session", found: "CalibrationCheck") -> list[str]:
    """Return sentences on clocks of the footage that the motion of the people contradicts, or that are not taken."""
    from tracker.pipeline.calibration_revisions import with_corrections
    from tracker.session.synchronize import footage_clocks

    try:
        return footage_clocks(with_corrections(session, found.corrections, found.middle_s, found.lost), "motion")[1]
    except TrackerError as error:
        return [command_line_text(error)]


def _apply(session: "Session", found: "CalibrationCheck", scores: list[tuple["FrameScore", "FrameScore"]]) -> list[str]:
    """Correct the named cameras; return the names of people whose sizes are then of an earlier calibration."""
    from tracker.pipeline.calibration_revisions import apply_check, follow_history, outdated_sizes
    from tracker.session.lock import SessionLock
    from tracker.session.store.annotation_store import AnnotationStore

    found.require_applicable(scores)
    with SessionLock(session.folder), AnnotationStore(session.annotations_path) as store:
        if follow_history(session, store) is not session:
            raise TrackerError(
                "expected the calibration that was checked, found one that an interrupted correction had left; it is "
                "restored, so check it again"
            )
        return outdated_sizes(apply_check(session, store, found), store)


def _as_json(found: "CalibrationCheck", scores: list[tuple["FrameScore", "FrameScore"]]) -> dict[str, Any]:
    from tracker.pipeline.calibration_check import n_better

    return {
        "named": list(found.named),
        "cameras": [_camera(c, found) for c in found.cameras],
        "explained": {
            "frames": list(found.frames),
            "nats": sum(c.gain_nats for c in found.cameras if c.kinds),
            "held_out_frames": len(scores),
            "held_out_better": n_better(scores),
            "sentences": found.sentences,
            "notes": list(found.notes),
        },
    }


def _camera(finding: "CameraFinding", check: "CalibrationCheck") -> dict[str, Any]:
    from tracker.geometry.camera_correction import in_units

    return {
        "name": finding.name,
        "misfit_px": finding.misfit_px,
        "misfit_mm": finding.misfit_mm,
        **in_units(finding.correction),
        "sigma": in_units(finding.sigma),
        "kind": "+".join(finding.kinds) or None,
        "as_well": list(finding.rivals),
        "since_frame": check.since.get(finding.name),
        "lost_frames": check.n_lost(finding.name),
    }


def _format(found: dict[str, Any]) -> str:
    lines, notes = list(found["explained"]["sentences"]), found["explained"]["notes"]
    if len(lines) == len(notes):
        lines = [*notes, "no camera is off: the contours agree with the calibration"]
    for camera in found["cameras"]:
        if camera["kind"] is not None:
            lines = [*lines, *_correction_lines(camera)]
    lines += [f"note: {note}" for note in found["clocks"]]
    n = found["explained"]["held_out_frames"]
    if n:
        lines = [*lines, f"of {n} other frames, {found['explained']['held_out_better']} fit better with it"]
    if found.get("applied"):
        names, again = " and ".join(found["outdated_sizes"]), "track again"
        if names:
            again = f"track with --acquire, which also acquires the sizes of {names} again"
        lines = [*lines, f"corrected; poses are still those of the calibration before: {again}"]
    elif found["named"]:
        lines = [*lines, "say --apply to correct it"]
    return "\n".join(lines)


def _correction_lines(camera: dict[str, Any]) -> list[str]:
    sigma, lines = camera["sigma"], []
    units = {"rotation_deg": "turned by (deg)", "position_mm": "moved by (mm)"}
    for key, words in units.items():
        if any(camera[key]):
            numbers = ", ".join(f"{v:.2f} ± {s:.2f}" for v, s in zip(camera[key], sigma[key], strict=True))
            lines.append(f"  {camera['name']} {words} right, down, forward: {numbers}")
    if camera["focal_percent"]:
        lines.append(
            f"  {camera['name']} focal length: {camera['focal_percent']:+.2f} ± {sigma['focal_percent']:.2f} %"
        )
    if camera["lost_frames"]:
        return [*lines, f"  {camera['name']} lost frames: {camera['lost_frames']}"]
    if camera["time_ms"]:
        lines.append(f"  {camera['name']} clock: {camera['time_ms']:+.1f} ± {sigma['time_ms']:.1f} ms")
    if camera["time_ms"] or camera["drift_ms_per_s"]:
        drift, deviation = camera["drift_ms_per_s"], sigma["drift_ms_per_s"]
        value = f"{drift:+.2f} ± {deviation:.2f}" if drift else f"not determinable, ± {deviation:.2f}"
        lines.append(f"  {camera['name']} drift of the clock: {value} ms a second")
    return lines
