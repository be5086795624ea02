"""`quadrille restore`: go back to a backup of damaged annotations, and write the edits of a rescue file."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.cli.arguments import OptionalName, OptionalPath, SessionArg
from app.remedies import command_line_text
from app.runtime.json_output import format_json
from tracker.errors import DamagedStoreError, SessionError

if TYPE_CHECKING:
    from tracker.session.store.backups import Restored


def command(
    session: SessionArg, /, backup: OptionalName = None, rescue: OptionalPath = None, json: bool = False
) -> None:
    """Go back to a backup of damaged annotations, and write edits that could not be written when the program ended.

    Each opening that finds the annotations as they were written keeps a backup of them in the folder `backups` of the
    session, the last three of them. The damaged file is kept beside the restored one. Edits that could not be written
    are in a rescue file, whose path the program has printed; each becomes an entry of the history, and the file is
    deleted. Edits that were made in another folder, of which this session may be a copy, are only listed.

    Args:
        session: session folder.
        backup: name of a file in `backups`, to go back to it even from annotations that are not damaged; by default
            the newest one that is not damaged itself.
        rescue: rescue file to write into this session, also where its edits were made in another folder; then the file
            stays.
        json: print one JSON object.
    """
    found = restore(session, backup, rescue)
    print(format_json(found) if json else _format(found))


def restore(folder: Path, backup: str | None, rescue: Path | None = None) -> dict[str, Any]:
    """Restore what a session has lost.

    Args:
        folder: of the session.
        backup: name of the backup to go back to, even if the store is not damaged.
        rescue: the rescue file to write, even if its edits were made in another folder; by default all of this one.

    Returns:
        A summary. `backup` is the path of the backup that was restored, None if there was no need; `kept` is the path
        of the file that it replaced; `backups` are the paths of all backups, newest first; `rescued` is the number of
        edits that were written from rescue files; `offers` describe those of other folders.

    Raises:
        SessionError: there is no session, no such backup, or none that is not damaged.
    """
    from tracker.session.folder import SESSION_FILE
    from tracker.session.lock import SessionLock
    from tracker.session.session import ANNOTATIONS_FILE
    from tracker.session.store import backups

    folder = Path(os.path.abspath(folder))
    if not (folder / SESSION_FILE).is_file():
        raise SessionError(f"{folder} is not a session: expected {SESSION_FILE} in it; give the folder of a session")
    path = folder / ANNOTATIONS_FILE
    with SessionLock(folder):
        damage = _damage(path)
        restored: Restored | None = None
        if backup is not None:
            restored = backups.restore(path, path.parent / backups.FOLDER / Path(backup).name)
        elif damage is not None:
            restored = backups.restore(path)
        rescued, offers = _replayed(folder, path, rescue)
    return {
        "folder": str(folder),
        "damage": damage,
        "backup": None if restored is None else str(restored.backup),
        "kept": None if restored is None or restored.kept is None else str(restored.kept),
        "rescued": rescued,
        "offers": offers,
        "backups": [str(path) for path in backups.backups_of(path)],
    }


def _replayed(folder: Path, path: Path, chosen: Path | None) -> tuple[int, list[str]]:
    """Write the edits of a rescue file, or of all that were made in a session, oldest first.

    Returns:
        The number of edits, and what is offered of other folders.
    """
    from app.storage import rescue
    from tracker.session.store.annotation_store import AnnotationStore

    with AnnotationStore(path, read_only=True) as store:
        files = rescue.find(folder, store.id)
    own = [found.path for found in files if not found.origin] if chosen is None else [chosen]
    offers = [command_line_text(*found.offer) for found in files if found.origin and found.path not in own]
    if not own:
        return 0, offers
    with AnnotationStore(path) as store:
        return sum(rescue.replay(each, folder, store) for each in own), offers


def _damage(path: Path) -> str | None:
    """Return why a store cannot be opened because of damage; None if it can, or is missing."""
    from tracker.session.store.annotation_store import AnnotationStore

    if not path.exists():
        return f"{path} is missing"
    try:
        AnnotationStore(path, read_only=True).close()
    except DamagedStoreError as error:
        return command_line_text(error)
    return None


def _format(found: dict[str, Any]) -> str:
    lines = []
    if found["backup"] is None and not found["rescued"]:
        lines.append(f"{found['folder']}: the annotations are as they were written, nothing to restore")
    if found["backup"] is not None:
        lines.append(f"{found['folder']}: restored {found['backup']}")
    if found["rescued"]:
        lines.append(f"{found['folder']}: wrote {found['rescued']} rescued edits, the last entries of its history")
    if found["kept"] is not None:
        lines.append(f"the file that it replaces is kept as {found['kept']}")
    lines += found["offers"]
    if found["backups"]:
        lines.append("backups, newest first: " + ", ".join(Path(b).name for b in found["backups"]))
    return "\n".join(lines)
