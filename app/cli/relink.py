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
        masks: folder of CAM/%06d.png by video frame.
        json: print one JSON object.
    """
    from tracker.session.relink import Places

    found = relink(session, Places(search, parse_pairs(camera, "--camera", Path), background, masks))
    print(format_json(found) if json else _format(found))
    if found["missing"]:
        sys.exit(1)


def relink(folder: Path, places: "Places") -> dict[str, Any]:
    """Give files of a session their new place.

    Args:
        folder: of the session.
        places: where to look.

    Returns:
        `relinked` lists what has a new place, `missing` what is still not found.

    Raises:
        TrackerError: a file does not fit, or files are missing and no place is given.
    """
    from tracker.footage.proxy import FOLDER, Proxy
    from tracker.session import relink as relinking
    from tracker.session.lock import SessionLock
    from tracker.session.missing_files import missing_files
    from tracker.session.session import load_session

    session = load_session(folder)
    missing = missing_files(session)
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
        "relinked": [_row(f.camera, f.kind) | {"old": str(f.old), "new": str(f.new)} for f in found],
        "missing": [_row(m.camera, m.kind) | {"path": str(m.path)} for m in missing_files(session)],
    }


def _row(camera: str, kind: str) -> dict[str, str]:
    return {"camera": camera, "kind": kind}


def _format(found: dict[str, Any]) -> str:
    if not found["relinked"] and not found["missing"]:
        return f"{found['folder']}: nothing is missing"
    lines = [f"{found['folder']}: {len(found['relinked'])} files have a new place, {len(found['missing'])} are missing"]
    lines += [f"  camera {f['camera']}: {f['kind']} {f['new']}" for f in found["relinked"]]
    lines += [f"  camera {m['camera']}: {m['kind']} {m['path']}, missing" for m in found["missing"]]
    return "\n".join(lines)
