"""Export the session to a file that the browser downloads.

A request names a format, people, frames and options; the file is made in a temporary folder, sent and deleted. No path
comes from the network. One export runs at a time.
"""

import asyncio
import logging
import tempfile
import zipfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from aiohttp import web

from app.runtime.jobs import StoppedError
from app.runtime.temporary_folder import TemporaryFolder
from app.server import connections
from app.server.page_requests import require_page
from tracker.errors import TrackerError
from tracker.interchange.exports.formats import FORMATS, OPTIONS, ExportFormat

if TYPE_CHECKING:
    from tracker.interchange.exports.motion import Checked

_LOG = logging.getLogger(__name__)
_CHUNK_BYTES = 1 << 18
_POSE_OPTIONS = ("frames", "only", "skip_lost")
"""Options of all formats: which poses are exported."""


class ExportRoutes:
    """Answers `/export`: the list of formats and imported observations, the progress, and the files."""

    def __init__(self, folder: Path) -> None:
        """Export the session of a folder."""
        self._folder = folder
        self._busy = asyncio.Lock()
        self._done, self._total = 0, 0
        self._is_ending = False

    def add_to(self, app: web.Application) -> None:
        """Add the routes to an application."""
        app.router.add_get("/export", self._list)
        app.router.add_get("/export/progress", self._progress)
        app.router.add_get("/export/{format}", self._export)
        app.router.add_get("/export/like/{name}", self._send_back)
        app.on_shutdown.append(self._end)

    async def _end(self, _: web.Application) -> None:
        self._is_ending = True

    async def _list(self, _: web.Request) -> web.Response:
        formats = [
            {
                "name": f.name,
                "title": f.title,
                "options": [*_POSE_OPTIONS, *sorted(f.options)],
                "axes": f.axes,
                "units": f.units,
                "holds_provenance": f.holds_provenance or f.is_folder,
                "numbering": f.numbering,
            }
            for f in FORMATS.values()
        ]
        return web.json_response(formats + await asyncio.to_thread(self._observations))

    def _observations(self) -> list[dict[str, Any]]:
        """Return imported observations, as formats in which their files are sent back."""
        from tracker.interchange.observations.stored import list_observations
        from tracker.session.session import load_session

        fields = {"options": ["poses"], "axes": "", "units": "", "holds_provenance": True, "numbering": ""}
        names = list_observations(load_session(self._folder))
        return [{"name": f"like/{quote(n)}", "title": f"{n}, as it came"} | fields for n in names]

    async def _progress(self, _: web.Request) -> web.Response:
        return web.json_response({"done": self._done, "total": self._total})

    async def _export(self, request: web.Request) -> web.StreamResponse:
        chosen = FORMATS.get(request.match_info["format"])
        if chosen is None:
            raise web.HTTPNotFound(text=f"Expected a format of {', '.join(FORMATS)}.\n")
        return await self._answer(request, lambda folder: self._make(chosen, request, folder))

    async def _send_back(self, request: web.Request) -> web.StreamResponse:
        """Send the files of observations as they came, with the points of mended poses."""
        name, poses = request.match_info["name"], request.query.get("poses", "edited")
        return await self._answer(request, lambda folder: self._make_like(name, poses, folder))

    async def _answer(self, request: web.Request, make: Callable[[Path], Path]) -> web.StreamResponse:
        """Send the file that `make` returns; it is made in a temporary folder."""
        require_page(request, None)
        if self._busy.locked():
            raise web.HTTPConflict(text="Another export is in progress; wait for it to finish.")
        async with self._busy:
            connections.keep_open(request)
            with closing(TemporaryFolder(tempfile.gettempdir())) as folder:
                try:
                    made = await asyncio.to_thread(make, folder.path)
                except StoppedError:
                    raise web.HTTPServiceUnavailable(text="The export was stopped.") from None
                finally:
                    self._done = self._total = 0
                return await _send(request, made)

    def _make(self, chosen: ExportFormat, request: web.Request, folder: Path) -> Path:
        """Make the file to send: the exported file, or a ZIP archive of several.

        Raises:
            TrackerError: an option is wrong, or there is nothing to export.
            StoppedError: nobody waits for it any more.
        """
        from tracker.formats.file_names import identifier
        from tracker.formats.model_toml import PRESETS
        from tracker.interchange.exports.export_files import check_options, export, n_ticks
        from tracker.interchange.exports.motion import read_motion
        from tracker.session.frame_list import parse_frame_list
        from tracker.session.session import load_session

        query = request.query
        session = load_session(self._folder)
        names = [p.name for p in session.people]
        person = query.get("person")
        if person is not None and person not in names:
            raise TrackerError(f"expected a person of {', '.join(names)}, found '{person}'; reload the page")
        people = tuple(range(len(names))) if person is None else (names.index(person),)
        character = query.get("character")
        if character is not None and character.partition(":")[0] not in PRESETS:
            raise TrackerError(
                f"expected a character among {', '.join(PRESETS)}, found '{character}'; choose one of them"
            )
        options = check_options(chosen, session, {name: query.get(name) for name in OPTIONS})
        options = replace(options, provenance=query.get("provenance") == "1")
        frames = None if not query.get("frames") else parse_frame_list(query["frames"], session.n_frames, "frames")
        motion = read_motion(session, people, frames, query.get("skip_lost") == "1", _checked(query.get("only")))
        self._total = n_ticks(chosen, motion)
        stem = identifier("_".join([session.folder.name, *([] if person is None or len(names) == 1 else [person])]))
        paths = export(chosen, motion, options, folder / f"{stem}{chosen.suffixes[0]}", tick=self._tick(request))
        if len(paths) == 1 and not chosen.is_folder:
            return paths[0]
        return _archive(paths, folder / f"{stem}_{chosen.name}.zip")

    def _make_like(self, name: str, poses: str, folder: Path) -> Path:
        """Make the file of observations to send: the one that was imported, or a ZIP archive of several.

        Raises:
            TrackerError: there are no such observations, or their points cannot be replaced.
        """
        from tracker.interchange.exports.like.patched_files import export_patched
        from tracker.interchange.observations.stored import load_observations
        from tracker.session.session import load_session

        if poses not in ("edited", "all"):
            raise TrackerError(f"expected poses as edited or all, found '{poses[:40]}'; reload the page")
        session = load_session(self._folder)
        observations = load_observations(session, name)
        is_one = len(observations.sources) == 1
        # A single file keeps its name below an existing folder.
        done = export_patched(session, observations, folder if is_one else folder / name, poses)
        return done.paths[0] if is_one else _archive([folder / name], folder / f"{name}.zip")

    def _tick(self, request: web.Request) -> Callable[[], None]:
        """Return what counts the progress, and stops the work when nobody waits for it."""

        def tick() -> None:
            self._done += 1
            if self._is_ending or request.transport is None or request.transport.is_closing():
                raise StoppedError

        return tick


def _archive(paths: Sequence[Path], archive: Path) -> Path:
    """Pack files and folders, which lie beside the archive."""
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        for path in (p for one in paths for p in (sorted(one.rglob("*")) if one.is_dir() else [one])):
            if path.is_file():
                file.write(path, path.relative_to(archive.parent))
    return archive


def _checked(text: str | None) -> "Checked | None":
    """Parse which poses a request exports.

    Raises:
        TrackerError: it is no such choice.
    """
    if text is None or text == "keyframes" or text == "reviewed":
        return text
    raise TrackerError(f"expected only as keyframes or reviewed, found '{text[:40]}'; reload the page")


async def _send(request: web.Request, path: Path) -> web.StreamResponse:
    """Send a file as a download."""
    headers: Mapping[str, Any] = {
        "Content-Type": "application/octet-stream",
        "Content-Length": str(path.stat().st_size),
        "Content-Disposition": f"attachment; filename*=UTF-8''{quote(path.name)}",
    }
    response = web.StreamResponse(headers=headers)
    await response.prepare(request)
    with path.open("rb") as file:
        while chunk := file.read(_CHUNK_BYTES):
            await response.write(chunk)
    await response.write_eof()
    return response
