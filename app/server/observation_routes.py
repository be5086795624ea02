"""Import observations that the page names by their paths, and send the report of a judgement.

A page names paths of this machine: `SessionRoutes` says where such requests are answered.
"""

import asyncio
import math
import tempfile
from contextlib import closing
from pathlib import Path
from typing import Annotated, Any, Literal
from urllib.parse import quote

import msgspec
from aiohttp import web
from msgspec import Meta

from app.control.controller import Controller
from app.remedies import page_text
from app.runtime.temporary_folder import TemporaryFolder
from app.server.page_requests import read_body, require_page
from app.session.import_summary import import_summary
from app.session.path_choice import TypedPaths, typed_paths
from tracker.errors import TrackerError
from tracker.formats.file_names import identifier
from tracker.formats.joint_maps import known_joint_maps
from tracker.geometry.lengths import METRES_BY_WORD
from tracker.interchange.observations.plans import ImportRequest
from tracker.validation import FileStem, Name

_Size = Annotated[int, Meta(ge=1, le=100_000, title="Picture size", description="a width and a height in pixels")]
_Confidence = Annotated[float, Meta(gt=0, le=1, title="Confidence", description="a confidence above 0 and at most 1")]
_Frame = Annotated[int, Meta(ge=-10_000_000, le=10_000_000, title="First frame", description="a frame of the session")]
_Skeleton = Annotated[str, Meta(max_length=40, title="Names of points", description="the name of a known skeleton")]
_Axes = Annotated[str, Meta(max_length=12, title="Axes", description="axes such as x,-z,y")]

_Offset = Annotated[int, Meta(ge=-10_000_000, le=10_000_000, title="Offset", description="a number of frames")]


class ImportForm(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Files to import, as a user names them."""

    paths: TypedPaths
    """Files or folders, separated by semicolons."""
    name: FileStem
    """Name of the observations within the session."""
    people: Annotated[list[Name], Meta(min_length=1, max_length=20, title="People", description="1 to 20 names")]
    """People of the session of whom they are."""
    first_frame: _Frame | None = None
    """Frame of the first picture or row; null to go by the numbers of the files."""
    offsets: dict[Name, _Offset] = {}
    """Frames by which the key points of a camera are late, by its name."""
    confidence: _Confidence | None = None
    """Confidence of points in files without one."""
    picture_size: tuple[_Size, _Size] | None = None
    """Width and height of the pictures that the points are of; 1, 1 for normalized points."""
    names_of_points: _Skeleton | None = None
    """Name of a known skeleton, in whose order or by whose names the points are; null to guess it."""
    axes: _Axes = "x,y,z"
    """Axes of the file that are the session's x, y and z."""
    units: Literal["m", "cm", "mm", "in", "ft"] | None = None
    """Unit of joints in space in a file that states none."""
    unusual: bool = False
    """Whether points are kept that fit no person of the recording, or fit one better in another way."""


class ObservationRoutes:
    """Answers what the section of observations asks for, below `/observations`."""

    def __init__(self, controller: Controller, refusal: str | None) -> None:
        """Serve the section.

        Args:
            controller: of the open session.
            refusal: why no path can be named; None if one can.
        """
        self._controller, self._refusal = controller, refusal
        self._busy = asyncio.Lock()

    def add_to(self, app: web.Application) -> None:
        """Add the routes to an application."""
        app.router.add_post("/observations/plan", self._plan)
        app.router.add_post("/observations/import", self._import)
        app.router.add_get("/observations/report", self._report)

    async def _plan(self, request: web.Request) -> web.Response:
        """Read and check files; the answer describes them, and the views show their points."""
        form = await read_body(request, ImportForm, self._refusal)
        async with self._busy:
            found = await asyncio.to_thread(self._planned, form)
        return web.json_response(found)

    def _planned(self, form: ImportForm) -> dict[str, Any]:
        session = self._controller.session
        known = [p.name for p in session.people]
        if strange := [n for n in form.people if n not in known]:
            raise TrackerError(f"expected people of {', '.join(known)}, found '{strange[0]}'; reload the page")
        request = ImportRequest(
            form.name, tuple(typed_paths(form.paths)), tuple(form.people), _known_map(form.names_of_points),
            first_frame=form.first_frame, offsets=form.offsets, axes=form.axes,
            unit_m=METRES_BY_WORD[form.units] if form.units else None, confidence=form.confidence,
            picture_size=form.picture_size, unusual=form.unusual,
        )  # fmt: skip
        found = import_summary(session, self._controller.observing.plan(request), page_text)
        for view in found["views"]:
            for key in ("confidence", "share"):
                view[key] = view[key] if math.isfinite(view[key]) else None
        return found

    async def _import(self, request: web.Request) -> web.Response:
        """Store the files that were read last."""
        require_page(request, self._refusal)
        async with self._busy:
            await asyncio.to_thread(self._controller.observing.store)
        return web.json_response({"stored": True})

    async def _report(self, request: web.Request) -> web.Response:
        """Send the report of the last judgement as a download."""
        require_page(request, None)
        async with self._busy:
            name, made = await asyncio.to_thread(self._reported)
        headers = {"Content-Disposition": f"attachment; filename*=UTF-8''{quote(name)}"}
        return web.Response(body=made, content_type="text/html", charset="utf-8", headers=headers)

    def _reported(self) -> tuple[str, bytes]:
        from app.export.judge_report import write_report

        session, found = self._controller.session, self._controller.state.observations
        if not found.judgements:
            raise TrackerError("expected a judgement, found none; judge imported observations first")
        name = f"{identifier(f'{session.folder.name}_{found.judged}')}_judged.html"
        with closing(TemporaryFolder(tempfile.gettempdir())) as folder:
            path = Path(folder.path) / name
            write_report(session, found.judged, found.judgements, path)
            return name, path.read_bytes()


def _known_map(name: str | None) -> Path | None:
    """Return the name of a known skeleton as the file of a joint map; the page names no files of joint maps.

    Raises:
        TrackerError: there is none of this name.
    """
    known = [m.name for m in known_joint_maps()]
    if name is not None and name not in known:
        raise TrackerError(f"expected as Names of points one of {', '.join(known)}, found '{name}'; correct it")
    return None if name is None else Path(name)
