"""`quadrille sync`: find and set when the cameras of a session began."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from app.cli.arguments import NamedValues, SessionArg, finite, parse_pairs
from app.runtime.json_output import format_json
from tracker.errors import TrackerError


def command(
    session: SessionArg,
    /,
    offset: NamedValues = (),
    drift: NamedValues = (),
    sound: bool = False,
    flash: bool = False,
    timecode: bool = False,
    apply: bool = False,
    json: bool = False,
) -> None:
    """Find when the cameras began, to a fraction of a frame, or set it.

    Poses, pins and history stay as they are: track again after a change.

    Args:
        session: session folder.
        offset: CAM=N: frame k of the session is frame k + N of this camera; N may have a fraction.
        drift: CAM=R: the clock of this camera changes against the session's by R seconds a second.
        sound: compare the sound of the videos.
        flash: compare when a light goes on in all pictures.
        timecode: compare the time codes of the videos, else GPS or creation times; of images, the times in their names.
        apply: write what is found clearly into session.toml.
        json: print one JSON object.
    """
    ways = [way for way, is_asked in (("sound", sound), ("flash", flash), ("time code", timecode)) if is_asked]
    found = synchronize(
        session, parse_pairs(offset, "--offset", finite), parse_pairs(drift, "--drift", finite), ways, apply
    )
    print(format_json(found) if json else _format(found))


def synchronize(
    folder: Path, offsets: dict[str, float], drifts: dict[str, float], ways: Sequence[str], apply: bool
) -> dict[str, Any]:
    """Find and set the clocks of a session's cameras; see `command`.

    Returns:
        `found` lists what was found, `notes` sentences on it, `cameras` the clocks of all cameras, `written` whether
        they are new.

    Raises:
        TrackerError: nothing is asked for, or too much; footage cannot be read, or an offset does not fit it.
    """
    from tracker.session.lock import SessionLock
    from tracker.session.session import load_session, save_camera_files
    from tracker.session.synchronize import find_starts, with_starts

    if len(ways) + bool(offsets or drifts) != 1:
        raise TrackerError(
            "expected one of --sound, --flash, --timecode, or --offset and --drift; say how to find the offsets"
        )
    session = load_session(folder)
    found, notes = find_starts(session, ways[0]) if ways else ([], [])
    if apply:
        offsets = {f.camera: f.start_frames for f in found if f.is_clear and f.start_frames is not None} or offsets
    written = bool(drifts or (offsets and (apply or not found)))
    if written:
        with SessionLock(session.folder):
            session = save_camera_files(session, with_starts(session, offsets, drifts).cameras)
    return {
        "folder": str(session.folder),
        "found": [f._asdict() for f in found],
        "notes": notes,
        "written": written,
        "cameras": [
            {
                "name": c.camera.name,
                "offset": c.offset,
                "time_offset_s": c.clock.ahead_frames / session.fps,
                "time_rate": c.clock.rate,
                "lost_frames": [list(lost) for lost in c.clock.lost],
            }
            for c in session.cameras
        ],
    }


def _format(found: dict[str, Any]) -> str:
    lines = []
    for f in found["found"]:
        if f["start_frames"] is None:
            lines.append(f"{f['camera']}: nothing found")
            continue
        sigma = "" if f["sigma_ms"] is None else f" +- {f['sigma_ms']:.2g} ms"
        verdict = "clear" if f["is_clear"] else "not clear, so not taken"
        stands = verdict if f["ratio"] is None else f"{f['ratio']:.1f} times the next: {verdict}"
        lines.append(f"{f['camera']}: offset {f['start_frames']:.3f} frames{sigma}, {stands}")
    lines += [f"note: {note}" for note in found["notes"]]
    if found["written"]:
        lines += ["written to session.toml; track again, since poses are of the former times"]
        lines += [
            f"  {c['name']}: offset {c['offset']}, {1000 * c['time_offset_s']:+.3f} ms, drift {c['time_rate']:g}"
            for c in found["cameras"]
        ]
    elif any(f["is_clear"] for f in found["found"]):
        lines.append("nothing written; say --apply to write what is clear")
    elif found["found"]:
        lines.append("nothing written: nothing that was found is clear")
    return "\n".join(lines)
