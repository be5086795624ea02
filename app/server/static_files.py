"""The page's files. The address of each names the version of all, so that a browser keeps them and never mixes two."""

import hashlib
import re
from pathlib import Path

from tracker.errors import TrackerError

PREFIX = "static/"
"""Beginning of their addresses, relative to that of the page."""
KEPT = "private, max-age=31536000, immutable"
"""`Cache-Control` of files whose address names their version."""
_VERSION = "[0-9a-f]{16}"
ROUTE = f"/{PREFIX}{{version:{_VERSION}}}/{{name:.+}}"
"""The route of these addresses, for aiohttp."""
_ADDRESS = re.compile(f"/{PREFIX}{_VERSION}/(?P<name>.+)")
_TYPES = {".js": "text/javascript", ".css": "text/css"}


def static_folder() -> Path:
    """Return the folder of the page: inside the installed package, or beside it in a checkout."""
    here = Path(__file__).resolve().parents[1]
    for folder in (here / "static", here.parent / "static"):
        if (folder / "index.html").is_file():
            return folder
    raise TrackerError(f"expected the page's files in '{here / 'static'}', found none; install quadrille again")


class PageFiles:
    """The modules and styles of the page, in memory.

    Loading the modules one after the other, as they import each other, takes a second. The starting page fetches them
    all while the program loads.
    """

    def __init__(self, folder: Path) -> None:
        """List the files.

        Args:
            folder: of the page (`static_folder`).
        """
        self._index = folder / "index.html"
        files = {p.relative_to(folder).as_posix(): p for p in sorted(folder.rglob("*")) if p.suffix in _TYPES}
        self._paths = {name: path for name, path in files.items() if not name.startswith("starting/")}
        self._contents: dict[str, bytes] = {}

    def addresses(self) -> dict[str, str]:
        """Read all files, which may have changed while the page is developed; return the address of each, by path."""
        self._contents = {name: path.read_bytes() for name, path in self._paths.items()}
        version = hashlib.sha256(repr(self._contents).encode()).hexdigest()[:16]
        return {name: f"{PREFIX}{version}/{name}" for name in self._paths}

    def index(self) -> str:
        """Return the page, which takes the files from their present addresses."""
        text = self._index.read_text("utf-8")
        for name, address in self.addresses().items():
            text = text.replace(f'"{PREFIX}{name}"', f'"{address}"')
        return text

    def find(self, address: str) -> tuple[bytes, str] | None:
        """Return the content and type of the file at the path of a request; None where there is none.

        Any version is accepted: a page that was opened before a file changed may still ask for the former one.
        """
        match = _ADDRESS.fullmatch(address)
        name = "" if match is None else match["name"]
        path = self._paths.get(name)
        if path is None:
            return None
        return self._contents.get(name) or path.read_bytes(), _TYPES[path.suffix]
