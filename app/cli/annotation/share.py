"""`quadrille share`: write a stretch of a session as a folder that opens in a browser, to be looked at."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from app.cli.arguments import OptionalRange, SessionArg
from app.cli.target import load_target
from app.runtime.json_output import format_json
from app.runtime.progress import Reporter
from tracker.errors import TrackerError

if TYPE_CHECKING:
    from app.share.content import SharedComment
    from tracker.session.session import Session


@dataclass(frozen=True)
class ShareArguments:
    """Arguments of `quadrille share`."""

    session: SessionArg
    """session folder."""
    out: Path
    """folder to write; a name that ends in .html writes one file, for short stretches."""
    frames: OptionalRange = None
    """A:B, half open; from the first to the last pose by default."""
    size: float = 30.0
    """largest size in megabytes: pictures are as large and good as it allows."""
    blur_faces: bool = False
    """blur the heads of all people who are known."""
    overwrite: bool = False
    """replace what an earlier share wrote there."""
    json: bool = False
    """print one JSON object."""


def command(arguments: Annotated[ShareArguments, tyro.conf.arg(name="")]) -> None:
    """Write pictures, bodies, curves and statuses of some frames as pages to look at, without the program or a server.

    Open OUT/index.html in a browser; no network is needed. Ctrl+C stops it and leaves nothing behind.
    """
    from app.share.folder import share
    from tracker.interchange.exports.motion import frames_text, read_motion
    from tracker.session.frame_list import parse_frame_list
    from tracker.session.relink import require_files

    at = load_target(arguments.session, None, several=True)
    if not 0 < arguments.size < float("inf"):
        raise TrackerError(f"expected --size as megabytes above 0, found {arguments.size:g}; 30 is the default")
    if not arguments.out.parent.is_dir():
        raise TrackerError(
            f"expected --out in a folder that exists, found none at {arguments.out.parent}; make it first"
        )
    text = arguments.frames
    frames = None if text is None else parse_frame_list(text, at.session.n_frames, "--frames")
    require_files(at.session)
    motion = read_motion(at.session, at.people, frames)
    with Reporter(silent=arguments.json).over(len(motion.frames), "sharing") as tick:
        n_bytes = share(
            motion, arguments.out, 1e6 * arguments.size, arguments.overwrite, tick, _comments(at.session),
            "blurred" if arguments.blur_faces else "shown",
        )  # fmt: skip
    opened = arguments.out if arguments.out.suffix.lower() == ".html" else arguments.out / "index.html"
    found: dict[str, Any] = {
        "open": str(opened),
        "bytes": n_bytes,
        "frames": len(motion.frames),
        "views": len(at.session.cameras),
        "people": [p.person.name for p in motion.exported],
    }
    if arguments.json:
        print(format_json(found))
        return
    print(f"wrote {arguments.out}, {n_bytes / 1e6:.1f} MB: {frames_text(motion.frames)} in {found['views']} views")
    print(f"open {opened} in a browser; it needs no network")


def _comments(session: "Session") -> list["SharedComment"]:
    """Read the comments of a session."""
    from app.share.content import SharedComment
    from tracker.annotation.plan import read_comments
    from tracker.session.store.annotation_store import AnnotationStore

    with AnnotationStore(session.annotations_path, read_only=True) as store:
        return [
            SharedComment(c.row.person, c.row.frame, c.row.limb, c.row.text, c.row.author, c.resolved)
            for c in read_comments(store)
        ]
