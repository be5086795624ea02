"""`quadrille info`: show the contents of a session."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from app.cli.arguments import SessionArg
from app.runtime.json_output import format_json
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from tracker.session.session import Session
    from tracker.session.store.records import FrameRow


def command(session: SessionArg, /, check: bool = True, json: bool = False) -> None:
    """Show the contents of a session.

    Args:
        session: session folder.
        check: look at the footage: its clocks, and at a few frames, whether two cameras are exchanged.
        json: print one JSON object.
    """
    from app.session.camera_check import exchange_note
    from tracker.session.session import load_session

    loaded = load_session(session)
    clocks, notes = _clocks(loaded) if check else ({}, [])
    summary = summarize(loaded, clocks, notes)
    is_complete = not any(c["missing"] for c in summary["cameras"])
    summary["warning"] = exchange_note(loaded) if check and is_complete else None
    print(format_json(summary) if json else _format(summary))


def summarize(
    session: "Session", clocks: Mapping[str, str] = MappingProxyType({}), notes: Sequence[str] = ()
) -> dict[str, Any]:
    """Summarize the cameras, people and poses of a session.

    Args:
        session: as it was loaded.
        clocks: of the footage, by camera.
        notes: sentences on them.
    """
    from tracker.footage.camera_source import missing_files
    from tracker.interchange.observations.stored import list_observations
    from tracker.interchange.observations.stored_masks import list_masks
    from tracker.session.store.annotation_store import AnnotationStore
    from tracker.session.store.calibration_log import read_posed_revisions

    missing = missing_files(session.cameras)
    poses: dict[str, list[FrameRow]] = {p.name: [] for p in session.people}
    if session.annotations_path.exists():
        with AnnotationStore(session.annotations_path, read_only=True) as store:
            poses = {name: store.frames(name) for name in poses}
    revisions = read_posed_revisions(session.annotations_path, list(poses))
    outdated = {
        name: sum(revisions.of(name, r.frame) != revisions.present for r in rows) for name, rows in poses.items()
    }
    return {
        "name": session.name,
        "folder": str(session.folder),
        "frames": session.n_frames,
        "fps": session.fps,
        "up": session.up,
        "cameras": [
            {
                "name": c.camera.name,
                "size": list(c.camera.size),
                "footage": str(c.footage),
                "background": c.background is not None,
                "masks": c.masks is not None,
                "offset": c.offset,
                "time_offset_s": c.clock.ahead_frames / session.fps,
                "time_rate": c.clock.rate,
                "lost_frames": [list(lost) for lost in c.clock.lost],
                "clock": clocks.get(c.camera.name),
                "missing": [m.kind for m in missing if m.camera == c.camera.name],
            }
            for c in session.cameras
        ],
        "people": [
            {
                "name": p.name,
                "model": p.model.name,
                "height_m": p.model.height_m,
                "dofs": p.model.n_dofs,
                "poses": len(poses[p.name]),
                "keyframes": sum(row.keyframe for row in poses[p.name]),
                "earlier_calibration": outdated[p.name],
            }
            for p in session.people
        ],
        "observations": [_observations(session, name) for name in list_observations(session)],
        "masks": [_masks(session, name) for name in list_masks(session)],
        "notes": list(notes),
    }


def _clocks(session: "Session") -> tuple[dict[str, str], list[str]]:
    """Return the clock of each camera's footage, and sentences where they contradict the session or cannot be read."""
    from app.remedies import command_line_text
    from tracker.session.synchronize import footage_clocks

    try:
        return footage_clocks(session)
    except TrackerError as error:
        return {}, [command_line_text(error)]


def _observations(session: "Session", name: str) -> dict[str, Any]:
    """Summarize imported observations; those that cannot be read are listed with the reason."""
    import numpy as np

    from tracker.interchange.observations.stored import load_observations

    try:
        found = load_observations(session, name)
    except TrackerError as error:
        return {"name": name, "error": str(error)}
    if found.points is not None:
        known = found.points.is_known
    else:
        assert found.joints is not None
        known = np.isfinite(found.joints.joints_world)
    return {
        "name": name,
        "format": found.format,
        "people": list(found.people),
        "points": len(found.point_names),
        "in_space": found.joints is not None,
        "frames": len(np.unique(np.nonzero(known)[0])),
        "files": len(found.sources),
    }


def _masks(session: "Session", name: str) -> dict[str, Any]:
    """Summarize imported masks; those that cannot be read are listed with the reason."""
    from tracker.interchange.observations.stored_masks import load_masks, mask_users

    try:
        found = load_masks(session, name)
    except TrackerError as error:
        return {"name": name, "error": str(error)}
    return {
        "name": name,
        "format": found.format,
        "pictures": dict(found.cameras),
        "used_by": list(mask_users(session, name)),
        "files": len(found.sources),
    }


def _format(summary: dict[str, Any]) -> str:
    lines = [f"{summary['name']}: {summary['frames']} frames at {summary['fps']:g} per second, up is {summary['up']}"]
    for c in summary["cameras"]:
        extras = "".join(f", {name}" for name in ("background", "masks") if c[name])
        shift = f", offset {c['offset']}" if c["offset"] else ""
        shift += f", {c['clock']}" if c["clock"] else ""
        missing = f"; missing: {', '.join(c['missing'])}" if c["missing"] else ""
        lines.append(f"  camera {c['name']}: {c['size'][0]}x{c['size'][1]}, {c['footage']}{extras}{shift}{missing}")
    for p in summary["people"]:
        body = f"{p['model']} of {p['height_m']:.2f} m, {p['dofs']} degrees of freedom"
        n = p["earlier_calibration"]
        earlier = f", {n} of an earlier calibration" if n else ""
        lines.append(f"  person {p['name']}: {body}, {p['poses']} poses, {p['keyframes']} keyframes{earlier}")
    for o in summary["observations"]:
        if "error" in o:
            lines.append(f"warning: observations {o['name']}: {o['error']}")
            continue
        kind = "points in space" if o["in_space"] else "key points"
        people = ", ".join(o["people"])
        lines.append(
            f"  observations {o['name']}: {o['points']} {kind} of {people} in {o['frames']} frames, {o['format']}"
        )
    for m in summary["masks"]:
        if "error" in m:
            lines.append(f"warning: masks {m['name']}: {m['error']}")
            continue
        users = f"used by {', '.join(m['used_by'])}" if m["used_by"] else "not used"
        n = sum(m["pictures"].values())
        lines.append(f"  masks {m['name']}: {n} pictures of {', '.join(m['pictures'])}, {m['format']}, {users}")
    if any(c["missing"] for c in summary["cameras"]):
        command = f"quadrille relink {summary['folder']} --search FOLDER"
        lines.append(f"warning: files are missing: put them back, or run {command}")
    lines += [f"note: {note}" for note in summary["notes"]]
    if summary["warning"] is not None:
        lines.append(f"warning: {summary['warning']}")
    return "\n".join(lines)
