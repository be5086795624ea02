"""`quadrille index`: make pictures of all frames of a session's videos."""

import sys

from app.cli.arguments import SessionArg
from app.runtime.json_output import format_json
from app.runtime.progress import Reporter


def command(session: SessionArg, /, json: bool = False) -> None:
    """Make pictures of all frames of the videos, so that the page shows any of them at once.

    They are stored in the session's folder, some 50 KB for each frame of 640x480 pixels. After Ctrl+C, run the command
    again to resume. Searching and tracking still use the videos.

    Args:
        session: session folder.
        json: print one JSON object.
    """
    from app.session.proxies import make_proxies
    from tracker.session.relink import require_files
    from tracker.session.session import load_session

    loaded = load_session(session)
    require_files(loaded)
    found = make_proxies(loaded, Reporter(silent=json))
    if json:
        print(format_json(found))
    else:
        frames = ", ".join(f"{name} {n}" for name, n in found["frames"].items())
        print(f"{found['folder']}: {frames} frames, {found['bytes'] / 1e6:.0f} MB" if frames else "no videos to index")
    if found["stopped"]:
        print("stopped; run it again to resume", file=sys.stderr)
        sys.exit(1)
