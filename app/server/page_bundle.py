"""Join the page's modules into one script, its style sheets into one sheet, and the markup of its rooms into one page.

A browser needs three times as long for 160 files as for two. The modules keep to plain forms: imports by name or as a
whole, exports where something is declared, both at the beginning of a line, and no cycles.
"""

import posixpath
import re
from collections.abc import Collection, Mapping

from tracker.errors import TrackerError

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
