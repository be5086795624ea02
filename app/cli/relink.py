"""`quadrille relink`: give moved footage of a session its new place."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.cli.arguments import NamedPaths, OptionalPath, Paths, SessionArg, parse_pairs
from app.runtime.json_output import format_json
from tracker.errors import SessionError

if TYPE_CHECKING:
    from tracker.session.relink import Places


def command(
    session: SessionArg,
    /,
    search: Paths = (),
    camera: NamedPaths = (),
    background: OptionalPath = None,
    masks: OptionalPath = None,
    no_masks: bool = False,
    json: bool = False,
) -> None:
    """Give moved or renamed footage of a session its new place.

    The new files must have the size, the number of frames and the frame rate of the old ones. Poses, pins and history
    stay as they are.

    Args:
        session: session folder.
        search: folders in which missing files are searched by name, with all folders inside.
        camera: NAME=PATH: footage of a camera, under any file name.
        background: folder of CAM.png or CAM.mp4 of the empty scene.
        masks: folder of CAM/%06d.png by video frame. Where no camera uses masks, those get them that it has.
        no_masks: let no camera use masks: their backgrounds count again. The files stay.
        json: print one JSON object.
    """
    from tracker.session.relink import Places

    found = relink(session, Places(search, parse_pairs(camera, "--camera", Path), background, masks), no_masks)
    print(format_json(found) if json else _format(found))
    if found["missing"]:
        sys.exit(1)


def relink(folder: Path, places: "Places", no_masks: bool = False) -> dict[str, Any]:
    """Give files of a session their new place.

    Args:
        folder: of the session.
        places: where to look.
        no_masks: whether cameras leave the masks that they use, first of all.

    Returns:
        `relinked` lists what has a new place, `left` the masks that cameras used, `missing` what is still not found.

    Raises:
        TrackerError: a file does not fit, or files are missing and no place is given.
    """
    from tracker.footage.camera_source import missing_files
    from tracker.footage.proxy import FOLDER, Proxy
    from tracker.session import relink as relinking
    from tracker.session.lock import SessionLock
    from tracker.session.session import load_session

    session = load_session(folder)
    left = [c for c in session.cameras if no_masks and c.masks is not None]
    if left:
        with SessionLock(session.folder):
            session = relinking.leave_masks(session)
    missing = missing_files(session.cameras)
    if missing and places == relinking.Places():
        raise SessionError(
            f"camera '{missing[0].camera}': {missing[0].kind} {missing[0].path} is missing; say where to look with "
            f"--search FOLDER, or where it is with --camera {missing[0].camera}=PATH"
        )
    with SessionLock(session.folder):
        session, found = relinking.relink(session, places)
        for f in found:
            if f.kind == "footage":
                Proxy(session.folder / FOLDER, f.camera).follow(f.new)
    return {
        "folder": str(session.folder),
        "relinked": [
            _row(f.camera, f.kind) | {"old": str(f.old) if f.old is not None else None, "new": str(f.new)}
            for f in found
        ],
        "left": [_row(c.camera.name, "masks") | {"path": str(c.masks)} for c in left],
        "missing": [_row(m.camera, m.kind) | {"path": str(m.path)} for m in missing_files(session.cameras)],
    }


def _row(camera: str, kind: str) -> dict[str, str]:
    return {"camera": camera, "kind": kind}


def _format(found: dict[str, Any]) -> str:
    left = [f"camera {m['camera']}: masks {m['path']} are left" for m in found["left"]]
    if not found["relinked"] and not found["missing"]:
        return "\n  ".join([f"{found['folder']}: nothing is missing", *left])
    lines = [f"{found['folder']}: {len(found['relinked'])} files have a new place, {len(found['missing'])} are missing"]
    lines += [f"  {line}" for line in left]
    lines += [f"  camera {f['camera']}: {f['kind']} {f['new']}" for f in found["relinked"]]
    lines += [f"  camera {m['camera']}: {m['kind']} {m['path']}, missing" for m in found["missing"]]
    return "\n".join(lines)
