"""Make intra-frame proxies of a session's videos, so that any frame is shown at once (`quadrille index`)."""

from contextlib import closing
from pathlib import Path
from typing import Any

from app.runtime.progress import Reporter
from tracker.errors import RecordingError
from tracker.files import refuse_links
from tracker.footage.camera_source import CameraSource
from tracker.footage.proxy import FOLDER, Proxy
from tracker.footage.video import open_footage
from tracker.session.lock import SessionLock
from tracker.session.session import Session


def make_proxies(session: Session, progress: Reporter) -> dict[str, Any]:
    """Make the proxies that are missing, incomplete, or made of other footage.

    An interrupted call keeps its frames, and the next call continues there.

    Returns:
        Number of frames of each camera's proxy, size of all proxies in bytes, and whether the call was interrupted.

    Raises:
        RecordingError: footage cannot be read, or a proxy cannot be written.
        SessionError: another program is making them.
    """
    folder: Path = session.folder / FOLDER
    refuse_links(session.folder, FOLDER)
    try:
        folder.mkdir(exist_ok=True)
        refuse_links(folder, *(path.name for path in folder.iterdir()))
    except OSError as error:
        raise RecordingError(
            f"cannot write the proxies into {folder}: {error.strerror}; make the session's folder writable, or "
            "copy the session to where you may write"
        ) from error
    made: dict[str, int] = {}
    stopped = False
    with SessionLock(folder):
        for source in session.cameras:
            name = source.camera.name
            if source.footage.is_dir():  # images need no proxy, and chapters have none
                continue
            with closing(open_footage(source.footage, name)) as footage:
                proxy = Proxy(folder, name)
                there = proxy.n_frames if proxy.fits(source.footage) else 0
                try:
                    with progress.over(footage.n_frames - there, f"{name}: frames") as tick:
                        for made[name] in proxy.make(source.footage, footage):
                            if made[name] > there:
                                tick()
                except KeyboardInterrupt:
                    stopped = True
            if stopped:
                break
    size = sum(path.stat().st_size for path in folder.glob("*.mjpeg"))
    return {"folder": str(folder), "frames": made, "bytes": size, "stopped": stopped}


def proxies(session: Session) -> list[Proxy | None]:
    """Return the proxy of each camera; None for a camera without a proxy of its present footage."""
    found = [Proxy(session.folder / FOLDER, c.camera.name) for c in session.cameras]
    return [p if _fits(p, c) else None for p, c in zip(found, session.cameras, strict=True)]


def stale(session: Session) -> list[str]:
    """Return the names of the cameras whose proxy was made of other footage."""
    found = [(Proxy(session.folder / FOLDER, c.camera.name), c) for c in session.cameras]
    return [c.camera.name for p, c in found if p.exists() and not _fits(p, c)]


def _fits(proxy: Proxy, source: CameraSource) -> bool:
    return source.footage.is_file() and proxy.fits(source.footage)
