"""The page's files. The address of each names the version of all, so that a browser keeps them and never mixes two.

`POLICY` and `connect_sources` are the content policy of the page. Imports little: the doorway answers before all else.
"""

import hashlib
import re
from pathlib import Path

from app.server.page_bundle import bundle_markup, bundle_script, bundle_styles
from tracker.errors import TrackerError

PREFIX = "static/"
"""Beginning of their addresses, relative to that of the page."""
KEPT = "private, max-age=31536000, immutable"
"""`Cache-Control` of files whose address names their version."""
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src {sources}; "
    "frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""`Content-Security-Policy` of the page, with a place for `connect_sources`."""
_STARTING = ("<html ", "<html data-starting ")
"""Mark of a page that is served while the program starts (static/starting)."""
_VERSION = "[0-9a-f]{16}"
ROUTE = f"/{PREFIX}{{version:{_VERSION}}}/{{name:.+}}"
"""The route of these addresses, for aiohttp."""
_ADDRESS = re.compile(f"/{PREFIX}{_VERSION}/(?P<name>.+)")
_TYPES = {".js": "text/javascript", ".css": "text/css"}
_INDEX = "index.html"
_NAMED = re.compile(f'"{PREFIX}([^"]+[.](?:js|css))"')
"""The files that the page names, by path."""


def static_folder() -> Path:
    """Return the folder of the page: inside the installed package, or beside it in a checkout."""
    here = Path(__file__).resolve().parents[1]
    for folder in (here / "static", here.parent / "static"):
        if (folder / _INDEX).is_file():
            return folder
    raise TrackerError(f"expected the page's files in '{here / 'static'}', found none; install quadrille again")


def connect_sources(host: str) -> str:
    """Return where the page may connect, by a checked Host header: 'self' covers WebSockets in some browsers only."""
    return f"'self' ws://{host} wss://{host}"


class PageFiles:
    """The scripts and the style sheet that the page names, in memory, joined with all that they import."""

    def __init__(self, folder: Path) -> None:
        """Take the files of a folder.

        Args:
            folder: of the page (`static_folder`).
        """
        self._folder = folder
        self._changed: dict[Path, int] = {}  # time of each file's last change
        self._contents: dict[str, bytes] = {}
        self._version = ""
        self._page = ""

    def index(self, is_starting: bool = False) -> str:
        """Return the page, which takes the files from their present addresses.

        Args:
            is_starting: whether the page has to wait for the program.

        Raises:
            TrackerError: a module cannot be joined.
        """
        self._read()
        text = self._page
        for name in self._contents:
            text = text.replace(f'"{PREFIX}{name}"', f'"{PREFIX}{self._version}/{name}"')
        return text.replace(*_STARTING, 1) if is_starting else text

    def find(self, address: str) -> tuple[bytes, str] | None:
        """Return the content and type of the file at the path of a request; None where there is none.

        Any version is accepted: a page that was opened before a file changed may still ask for the former one.
        """
        match = _ADDRESS.fullmatch(address)
        if match is None:
            return None
        if not self._contents:  # pages that were opened before the program started again
            self._read()
        name = match["name"]
        return (self._contents[name], _TYPES[Path(name).suffix]) if name in self._contents else None

    def _read(self) -> None:
        """Read and join the files, unless none has changed: they change while the page is developed."""
        paths = [path for path in sorted(self._folder.rglob("*")) if path.suffix in (*_TYPES, ".html")]
        changed = {path: path.stat().st_mtime_ns for path in paths}
        if changed == self._changed:
            return
        files = {path.relative_to(self._folder).as_posix(): path.read_text("utf-8") for path in paths}
        self._page = bundle_markup(_INDEX, files)
        named = _NAMED.findall(self._page)
        joined = {
            name: bundle_script(name, files, named) if name.endswith(".js") else bundle_styles(name, files)
            for name in named
        }
        self._contents = {name: text.encode() for name, text in joined.items()}
        self._version = hashlib.sha256(repr(self._contents).encode()).hexdigest()[:16]
        self._changed = changed
