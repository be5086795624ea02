"""Write the shared pages: a folder, or one file that holds all."""

import base64
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from app.server.static_files import bundle_script, bundle_styles, static_folder
from app.session.footage_indices import footage_indices
from app.share.content import SharedComment, describe
from app.share.overlay_lines import UNITS_PER_PX, compact, view_lines
from app.share.pictures import GRADES, Encoder, choose_encoder
from tracker.footage.recording import Recording
from tracker.interchange.exports.export_files import moved_at_end, unwritable
from tracker.interchange.exports.faces import recording_of
from tracker.interchange.exports.motion import ExportedMotion, FacesName

_FILES = ("index.html", "page.js", "page.css", "data.js")
"""Files of a shared folder beside its pictures."""
_TEXT_BYTES = 4 / 3
"""Bytes of text for each byte of a picture in one file, Base64."""


def is_shared_folder(path: Path) -> bool:
    """Return whether a folder is one that `share` has made, and may replace."""
    return all((path / name).is_file() for name in _FILES)


def share(
    motion: ExportedMotion,
    out: Path,
    most_bytes: float,
    overwrite: bool = False,
    tick: Callable[[], None] = lambda: None,
    comments: Sequence[SharedComment] = (),
    faces: FacesName = "shown",
) -> int:
    """Write a stretch of a session as a folder with index.html, or as one file.

    Args:
        motion: the poses, and the frames to show.
        out: a folder; a file if it ends in .html.
        most_bytes: largest size of the whole.
        overwrite: whether to replace a file, or a folder that `share` has made. An empty folder is replaced anyway.
        tick: called after each frame; it may raise to stop, which leaves nothing behind.
        comments: of the session.
        faces: as filmed, or blurred.

    Returns:
        The size, bytes.

    Raises:
        TrackerError: the place is taken or cannot be written, or the pictures do not fit.
        RecordingError: the footage cannot be read.
    """
    is_file = out.suffix.lower() == ".html"
    try:
        is_empty = not is_file and out.is_dir() and not any(out.iterdir())
        may_replace = None if is_file else (lambda path: is_empty or is_shared_folder(path))
        with (
            moved_at_end([out], overwrite or is_empty, may_replace) as temporary,
            recording_of(motion, faces, footage_indices()) as recording,
        ):
            largest = Encoder(motion.session, GRADES[0])
            room = most_bytes - len(compact(describe(motion, largest.views, comments)))
            encoder = choose_encoder(motion, recording, room, _TEXT_BYTES if is_file else 1.0)
            target = temporary / out.name
            folder = None if is_file else target / "pictures"
            data = describe(motion, encoder.views, comments) | _content(motion, recording, encoder, folder, tick)
            return _write_file(target, data) if is_file else _write_folder(target, data)
    except OSError as error:
        raise unwritable(out, error) from error


def _content(
    motion: ExportedMotion, recording: Recording, encoder: Encoder, folder: Path | None, tick: Callable[[], None]
) -> dict[str, Any]:
    """Return pictures and lines of the page; without a folder, addresses of pictures are the pictures themselves."""
    n_views = len(encoder.views)
    pictures: list[list[str]] = [[] for _ in range(n_views)]
    lines = []
    if folder is not None:
        for view in range(n_views):
            (folder / str(view)).mkdir(parents=True)
    for frame in motion.frames:
        for view, image in enumerate(recording.read(frame)):
            encoded = encoder.encode(view, image)
            if folder is None:
                pictures[view].append(f"data:image/webp;base64,{base64.b64encode(encoded).decode()}")
            else:
                name = f"{view}/{frame:06d}.webp"
                (folder / name).write_bytes(encoded)
                pictures[view].append(f"pictures/{name}")
        lines.append(view_lines(motion, frame, encoder.views))
        tick()
    return {"pictures": pictures, "lines": lines, "units_per_px": UNITS_PER_PX}


def _write_folder(target: Path, data: dict[str, Any]) -> int:
    script, styles, page = _page_sources()
    head = '<link rel="stylesheet" href="page.css" />'
    scripts = '<script src="data.js"></script><script src="page.js"></script>'
    texts = (_filled(page, head, scripts), script, styles, _data_script(data))
    for name, text in zip(_FILES, texts, strict=True):
        (target / name).write_text(text, "utf-8", newline="")
    return sum(path.stat().st_size for path in target.rglob("*") if path.is_file())


def _write_file(target: Path, data: dict[str, Any]) -> int:
    script, styles, page = _page_sources()
    scripts = "".join(f"<script>{text}</script>" for text in (_data_script(data), script))
    target.write_text(_filled(page, f"<style>{styles}</style>", scripts), "utf-8", newline="")
    return target.stat().st_size


def _page_sources() -> tuple[str, str, str]:
    """Return the script, the style sheet and the frame of the page. The script is classic: modules need a server."""
    folder = static_folder()
    files = {
        path.relative_to(folder).as_posix(): path.read_text("utf-8")
        for path in [*folder.glob("share/*"), *folder.glob("widgets/*.js"), folder / "styles" / "tokens.css"]
    }
    script = f'"use strict";\n(() => {{\n{bundle_script("share/index.js", files)}}})();\n'
    return script, bundle_styles("share/share.css", files), files["share/share.html"]


def _filled(page: str, head: str, scripts: str) -> str:
    return page.replace("<!-- styles -->", head).replace("<!-- scripts -->", scripts)


def _data_script(data: dict[str, Any]) -> str:
    """Return data as a script. No text in it can end the script: `<` is escaped, and all beyond ASCII."""
    text = compact(data).replace("<", "\\u003c")
    return f"globalThis.quadrilleShare = {text};\n"
