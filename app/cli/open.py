"""`quadrille open`: open a session in the page."""

import gc
from contextlib import closing
from pathlib import Path
from typing import Annotated

import tyro

from app.cli.arguments import Names, OptionalName, OptionalWhole
from tracker.errors import TrackerError

_SessionOrSample = Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="SESSION", help_behavior_hint="")]


def command(
    session: _SessionOrSample = None,
    /,
    host: str = "127.0.0.1",
    port: OptionalWhole = None,
    allow_host: Names = (),
    browser: bool = True,
    token: bool = True,
    share: bool = False,
    sample: OptionalName = None,
    start_again: bool = False,
    frame: OptionalWhole = None,
    person: OptionalName = None,
    annotator: OptionalName = None,
) -> None:
    """Open a session in the page; without SESSION, a working copy of a bundled sample.

    Args:
        session: session folder.
        host: address to listen at; anything but loopback needs --allow-host.
        port: port to listen at; 0 takes a free one, and by default the first free one from 8080 to 8089 is taken.
        allow_host: names by which browsers may call this machine.
        browser: open the page in the default browser.
        token: require the token in the printed address. Without it every account of this machine can use the page.
        share: print links for other people too: to annotate, to review and to look. They end with this start.
        sample: name of the sample: tango, two people to be placed by hand (the default), or elbow_rotation, one person.
        start_again: discard the working copy of the sample and make a new one.
        frame: frame to show first.
        person: name of the person to select.
        annotator: name of the person who annotates, remembered; by default $QUADRILLE_ANNOTATOR, then the login.
    """
    from app.runtime.kernel_compiler import KernelCompiler
    from app.runtime.restart import restart
    from app.server.address import Serving
    from app.server.startup_server import StartupServer
    from app.session.annotator import set_annotator
    from app.session.samples import DEFAULT_SAMPLE, sample_copy
    from tracker.session.folder import session_folder
    from tracker.session.lock import SessionLock

    if session is not None and (sample is not None or start_again):
        raise TrackerError(
            f"expected a session or a sample, found {session} and {'--sample' if sample else '--start-again'}; "
            "leave one of them out"
        )
    set_annotator(annotator)
    folder = sample_copy(sample or DEFAULT_SAMPLE, start_again) if session is None else session
    folder = session_folder(folder)
    serving = Serving(host, port, allow_host, browser, token, share)
    with SessionLock(folder), StartupServer(serving) as doorway, closing(KernelCompiler()) as compiler:
        # These imports take seconds: the doorway answers meanwhile, and kernels are compiled. Objects made here stay.
        gc.disable()
        from app.cli.target import load_target
        from tracker.session.relink import require_files

        at = load_target(folder, person, several=True)
        found = at.session
        if frame is not None and not 0 <= frame < found.n_frames:
            raise TrackerError(f"expected --frame from 0 to {found.n_frames - 1}, found {frame}; correct it")
        require_files(found)
        doorway.open_browser()

        from app.server.workbench import FirstView, serve_until_closed

        gc.freeze()
        gc.enable()
        first = FirstView(frame or 0, 0 if person is None else at.people[0])
        chosen = serve_until_closed(found, doorway, compiler, lambda line: print(line, flush=True), first)
    if chosen is not None:
        words = ["open", str(chosen.folder), "--host", host, "--port", str(chosen.port), "--no-browser"]
        words += ["--frame", str(chosen.frame)] if chosen.frame else []
        words += ["--person", chosen.person] if chosen.person else []
        restart(words, chosen.listening)
