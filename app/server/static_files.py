"""The page's files. The address of each names the version of all, so that a browser keeps them and never mixes two.

`POLICY` and `connect_sources` are the content policy of the page. Imports little: the doorway answers before all else.

Join the page's modules into one script, its style sheets into one sheet, and the markup of its rooms into one page.

A browser needs three times as long for 160 files as for two. The modules keep to plain forms: imports by name or as a
whole, exports where something is declared, both at the beginning of a line, and no cycles.
"""

import hashlib
import posixpath
import re
from collections.abc import Collection, Mapping
from pathlib import Path

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


_IMPORT = re.compile(r'^import (?:\{(?P<names>[^}]*)\}|\* as (?P<whole>\w+)) from "(?P<path>\.[^"]+)";', re.MULTILINE)
_EXPORT = re.compile(r"^export (?=(?:async )?(?:class|const|function\*?) (?P<name>\w+))", re.MULTILINE)
_OTHER = re.compile(r"^(?:import|export)\b.*", re.MULTILINE)
_MARKUP = re.compile(r"^ *<!-- (?P<path>\S+\.html) -->$", re.MULTILINE)
_STYLE_IMPORT = re.compile(r'^@import url\("(?P<path>[^"]+)"\);', re.MULTILINE)


def bundle_script(entry: str, files: Mapping[str, str], separate: Collection[str] = ()) -> str:
    """Return a module that does what the entry does.

    Args:
        entry: path of a module.
        files: text of each file by path.
        separate: paths of modules that are still imported, because the page loads them by themselves.

    Raises:
        TrackerError: a module is missing, imports itself, or has another form of import or export.
    """
    bundle = _Bundle(files, separate, posixpath.dirname(entry))
    bundle.add(entry)
    return "".join(bundle.parts)


def bundle_styles(entry: str, files: Mapping[str, str]) -> str:
    """Return a style sheet with the sheets that it imports in their places.

    Args:
        entry: path of the sheet.
        files: text of each file by path.

    Raises:
        TrackerError: a sheet is missing.
    """
    return _STYLE_IMPORT.sub(lambda found: bundle_styles(_beside(entry, found["path"]), files), _text(entry, files))


def bundle_markup(entry: str, files: Mapping[str, str]) -> str:
    """Return a page with the markup of rooms in the places of the comments that name it.

    Args:
        entry: path of the page.
        files: text of each file by path.

    Raises:
        TrackerError: a file is missing.
    """
    return _MARKUP.sub(lambda found: bundle_markup(found["path"], files), _text(entry, files))


class _Bundle:
    def __init__(self, files: Mapping[str, str], separate: Collection[str], folder: str) -> None:
        self.parts: list[str] = []
        self._files, self._separate, self._folder = files, separate, folder
        self._names: dict[str, str] = {}  # of the constant that holds a module's exports, by path
        self._underway: list[str] = []  # modules whose imports are being added
        self._n_modules = 0

    def add(self, path: str, name: str = "") -> None:
        """Append a module after all that it imports; a constant of that name holds its exports."""
        self._underway.append(path)
        text = _IMPORT.sub(lambda found: self._imported(path, found), _text(path, self._files))
        inner = _EXPORT.sub("", text)
        if other := _OTHER.search(inner):
            raise TrackerError(f"expected static/{path} to import and export by name, found '{other[0]}'; write it so")
        self._underway.pop()
        if name:
            exported = ", ".join(found["name"] for found in _EXPORT.finditer(text))
            text = f"const {name} = (() => {{\n{inner}return {{ {exported} }};\n}})();\n"
        self.parts.append(f"// {path}\n{text}")

    def _imported(self, importer: str, found: re.Match[str]) -> str:
        """Return the statement that stands for an import, with as many lines."""
        path = _beside(importer, found["path"])
        if path in self._underway:
            raise TrackerError(f"expected static/{path} not to import itself, found it in {importer}; break the cycle")
        if path not in self._names:
            self._n_modules += 1
            self._names[path] = name = f"$module{self._n_modules}"
            if path in self._separate:
                self.parts.append(f'import * as {name} from "./{posixpath.relpath(path, self._folder or ".")}";\n')
            else:
                self.add(path, name)
        bound = found["whole"] or "{" + re.sub(r"(\w+) as (\w+)", r"\1: \2", found["names"]) + "}"
        return f"const {bound} = {self._names[path]};"


def _beside(importer: str, path: str) -> str:
    return posixpath.normpath(posixpath.join(posixpath.dirname(importer), path))


def _text(path: str, files: Mapping[str, str]) -> str:
    if path not in files:
        raise TrackerError(f"expected the page's file static/{path}, found none; install quadrille again")
    return files[path]
