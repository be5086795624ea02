"""Open a session in the page: store, controller, 3-D view and web server."""

import asyncio
import signal
import socket
import threading
from collections.abc import Callable, Coroutine
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from platformdirs import user_state_path

from app.control.controller import Controller
from app.page.socket import PaneSocket
from app.participants.participants import Participants
from app.remedies import command_line_text, page_text
from app.runtime.kernel_compiler import KernelCompiler
from app.scene3d.gizmos import Gizmos
from app.scene3d.scene import SceneView
from app.server.access import is_loopback
from app.server.copy_routes import CopyRoutes
from app.server.export_routes import ExportRoutes
from app.server.key_routes import KeyRoutes
from app.server.observation_routes import ObservationRoutes
from app.server.private_viser import PrivateViser
from app.server.server import create_app, serve_forever
from app.server.session_routes import SessionRoutes, refusal
from app.server.startup_server import StartupServer
from app.server.static_files import static_folder
from app.server.thumbnails import ThumbnailRoutes, Thumbnails
from app.session import proxies
from app.session.annotator import annotator_or_login
from app.session.footage_indices import footage_indices
from app.session.footage_pictures import FootageCrops
from app.session.frame_cache import FrameCache
from app.session.recent_sessions import remember
from app.storage import rescue
from app.storage.saver import Saver
from tracker.errors import TrackerError
from tracker.evidence.observer import Observer
from tracker.footage.recording import Recording
from tracker.pipeline.calibration_revisions import follow_history
from tracker.session.session import Session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.system import ENDING_SIGNALS

_ANSWER_S = 0.3
"""Time for the answer to a page that has chosen another session."""


class NextSession(NamedTuple):
    """A session that the page has asked for."""

    folder: Path
    frame: int
    """Frame to show first."""
    person: str
    """Name of the person to select; empty for the first one."""
    port: int
    """Port of the page, which connects again there."""
    listening: tuple[socket.socket, ...]
    """Copies of the sockets of that port: connections wait there for the next program."""


class FirstView(NamedTuple):
    """Frame and person that the page shows first."""

    frame: int = 0
    person: int = 0
    """Index of the selected person."""


_BEGINNING = FirstView()


def serve_until_closed(
    session: Session,
    doorway: StartupServer,
    compiler: KernelCompiler,
    say: Callable[[str], None],
    first: FirstView = _BEGINNING,
    begun: Callable[[Controller, Callable[[], None]], None] = lambda controller, stop: None,
) -> NextSession | None:
    """Serve the page of a session until the program is interrupted, or the page asks for another session.

    Args:
        session: to open; the caller holds its lock.
        doorway: answers at the page's address meanwhile.
        compiler: compiles missing kernels; the caller closes it.
        say: shows a line to the user.
        first: what the page shows first.
        begun: called once when the page answers, with a function that ends it from another thread.

    Returns:
        The session to open next; None if the program was interrupted.

    Raises:
        TrackerError: the session cannot be opened.
    """
    doorway.show("Opening the session")
    tokens, serving = user_state_path("quadrille", appauthor=False), doorway.serving
    indices = footage_indices()
    with Recording(session.cameras, indices=indices, in_background=True) as recording:
        remember(tokens, session.folder)
        store = AnnotationStore(session.annotations_path)
        session = follow_history(session, store)  # A correction may have been cut off.
        if store.backup_error is not None:
            say(store.backup_error)
        offers = [page_text(*found.offer) for found in rescue.find(session.folder, store.id)]
        for offer in offers:
            say(offer)
        doorway.show("Preparing the views")
        frames = FrameCache(Observer(session.cameras, recording), proxies.proxies(session))
        saver = Saver(session, store, annotator_or_login())
        controller = Controller(session, saver, frames, compiler)
        controller.navigation.seek(first.frame)
        controller.navigation.select(first.person, None)
        viser = PrivateViser()
        participants = Participants(controller)
        thumbnails = Thumbnails(controller, FootageCrops(session.cameras, indices))
        try:
            SceneView(viser.server, controller)
            Gizmos(viser.server, controller)
            app = create_app(PaneSocket(participants, offers), viser.place, doorway.access, static_folder())
            ExportRoutes(session.folder).add_to(app)
            is_private = is_loopback(serving.host) and not serving.allow_hosts
            no_paths = refusal(is_private, serving.token)
            others = SessionRoutes(session.folder, tokens, no_paths, lambda: controller.state.save_error)
            others.add_to(app)
            KeyRoutes(tokens, serving.token).add_to(app)
            ObservationRoutes(controller, no_paths).add_to(app)
            CopyRoutes(controller, no_paths).add_to(app)
            ThumbnailRoutes(thumbnails.jpeg, lambda: not _can_draw(controller)).add_to(app)

            def ready() -> None:
                for name in proxies.stale(session):
                    say(f"the proxy of camera {name} is of other footage: run quadrille index {session.folder} again")
                say(f"{session.name}: {doorway.address}")
                for role, address in doorway.shared_addresses.items():
                    say(f"to {role}: {address}")
                loop = asyncio.get_running_loop()
                begun(controller, partial(_end_from_a_thread, loop, others.is_chosen))

            doorway.close()
            served = serve_forever(app, [each.dup() for each in doorway.sockets], ready)
            asyncio.run(_until_interrupted(served, others.is_chosen))
        finally:
            try:
                participants.close()
                controller.close()
            finally:  # also where a second Ctrl+C ends the work
                unsaved = _keep_unsaved(saver, session.folder)
                thumbnails.close()
            viser.stop()
            store.close()
            if unsaved is not None:
                raise TrackerError(unsaved)
    if others.chosen is None:
        return None
    return NextSession(*others.chosen, doorway.port, tuple(each.dup() for each in doorway.sockets))


def _end_from_a_thread(loop: asyncio.AbstractEventLoop, ended: asyncio.Event) -> None:
    loop.call_soon_threadsafe(ended.set)


def _can_draw(controller: Controller) -> bool:
    """Return whether thumbnails can be made: compiling a kernel, or listing footage, would take long."""
    return not controller.state.compiling and controller.frames.is_listed


def _keep_unsaved(saver: Saver, folder: Path) -> str | None:
    """Keep edits that cannot be written; returns a message for the user, None if all are saved."""
    if saver.error is None:
        return None
    try:
        path = saver.rescue()
    except TrackerError as error:
        return f"edits are lost: {saver.error}; {command_line_text(error)}"
    return f"edits are not saved: {saver.error}; they are kept in {path}, and 'quadrille restore {folder}' writes them"


async def _until_interrupted(serving: Coroutine[Any, Any, None], is_chosen: asyncio.Event) -> None:
    """Run until SIGINT, SIGTERM, the terminal's end or the choice of another session; then shut the server down."""
    task = asyncio.ensure_future(serving)
    choice = asyncio.ensure_future(is_chosen.wait())
    is_program = threading.current_thread() is threading.main_thread()  # signals are for programs alone
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, *ENDING_SIGNALS) if is_program else ():
        try:
            loop.add_signal_handler(number, task.cancel)
        except NotImplementedError:  # loops of Windows have no such handlers
            signal.signal(number, lambda *_: loop.call_soon_threadsafe(task.cancel))
    await asyncio.wait({task, choice}, return_when=asyncio.FIRST_COMPLETED)
    if not choice.cancel():
        await asyncio.sleep(_ANSWER_S)
        task.cancel()
    try:
        await task
    except asyncio.CancelledError:
        if not task.cancelled():
            raise
