"""Check values of files and messages against their declarations (msgspec), and explain the first wrong one.

Types, ranges and sizes are declared once, as `msgspec.Struct` with `Meta`. The `description` of a `Meta` is what the
message says was expected.
"""

import re
import unicodedata
from typing import Annotated, Any, NamedTuple, TypeAlias, TypeVar

import msgspec
from msgspec import Meta

from tracker.errors import TrackerError

T = TypeVar("T")

MAX_FRAMES = 10_000_000
"""Largest number of frames of a session or table: a day at 100 frames per second."""
MAX_NUMBER = 1e9
"""Largest number of a file: no unit of length makes a room so large."""
ROUNDING = 1e-6
"""Error of a number of size 1, such as a part of a unit vector, that was written as text."""
MAX_SIDE_PX = 32_767
"""Largest width and height of a camera's image; OpenCV resamples no larger ones."""

UNPRINTABLE = r"\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff\ud800-\udfff"
"""Characters that names cannot hold, for a regular expression: controls, which terminals obey, line ends, marks that
turn the direction of writing (Unicode's Bidi_Control), the byte order mark and halves of characters."""

Number: TypeAlias = Annotated[float, Meta(ge=-MAX_NUMBER, le=MAX_NUMBER, description="a finite number within 1e9")]
Vector: TypeAlias = Annotated[tuple[Number, Number, Number], Meta(description="3 finite numbers")]
Name: TypeAlias = Annotated[
    str,
    Meta(
        pattern=rf"^[^{UNPRINTABLE}]{{1,200}}\Z",
        description="a name of 1 to 200 characters on one line, without control or direction characters",
    ),
]
FileStem: TypeAlias = Annotated[
    str,
    Meta(
        pattern=rf"^(?!\.{{1,2}}\Z)[^{UNPRINTABLE}/\\]{{1,100}}\Z",
        description="a name of 1 to 100 characters on one line, without slashes, control or direction characters",
    ),
]
"""A name after which files are named too; it must not lead out of their folder."""
FilePath: TypeAlias = Annotated[
    str,
    Meta(
        pattern=r"^[^\x00-\x1f\x7f-\x9f]{1,1000}\Z",
        description="at most 1000 characters without line ends and other controls, the path of a file or folder",
    ),
]
"""Scripts and files have it, where a line end would begin a line of its own."""
Color: TypeAlias = Annotated[str, Meta(pattern=r"^#[0-9a-fA-F]{6}\Z", description="a colour such as #f2a33a")]
FrameRate: TypeAlias = Annotated[
    float, Meta(ge=1e-3, le=1e5, description="a frame rate above 0, from 0.001 to 100000 per second")
]

_ANY_DAY = r"(?:0[1-9]|1[0-2])-(?:0[1-9]|1\d|2[0-8])|(?:0[13-9]|1[0-2])-(?:29|30)|(?:0[13578]|1[02])-31"
_LEAP_YEAR = r"(?:\d\d(?:0[48]|[2468][048]|[13579][26])|(?:[02468][048]|[13579][26])00)"
_DAY = rf"(?:\d{{4}}-(?:{_ANY_DAY})|{_LEAP_YEAR}-02-29)"
_CLOCK = r"(?:[01]\d|2[0-3]):[0-5]\d:[0-5]\d(?:\.\d{3}|\.\d{6})?"
"""Days of all years, leap years, days and clock times, for a regular expression."""
Time: TypeAlias = Annotated[
    str,
    Meta(
        pattern=rf"(?a)^(?!0000|9999){_DAY}T{_CLOCK}\+00:00\Z",
        description="a time in UTC such as 2026-11-27T09:30:00.000000+00:00",
    ),
]
"""A time as stores have it: as text, times are in order. The calendar has the day, as `datetime.fromisoformat` demands.
The year is from 1 to 9998, so that later times can follow."""


def nfc_name(name: str) -> str:
    """Return a name in the one Unicode form in which names are compared (NFC).

    A Mac stores a letter and its accent apart, so that a file's name differs from the same name typed.
    """
    return unicodedata.normalize("NFC", name)


def check(value: Any, declaration: Any, where: str, error_type: type[TrackerError]) -> Any:
    """Convert plain data to its declaration.

    Args:
        value: what a TOML or JSON file holds.
        declaration: a type that msgspec knows, such as a Struct.
        where: kind and place of the data, for the message: `calibration lab.toml`.
        error_type: kind of error to raise.

    Raises:
        TrackerError: of the given kind; the message has the key, what was expected and what was found.
    """
    try:
        return msgspec.convert(value, declaration)
    except msgspec.ValidationError as error:
        expected, found = explain(error, value, declaration)
        advice = "" if "; " in found else "; correct it"
        raise error_type(f"{where}: expected {expected}, found {found}{advice}") from error


def check_version(data: dict[str, Any], newest: int, where: str, error_type: type[TrackerError]) -> None:
    """Refuse a file of a newer program before its unknown keys do.

    Raises:
        TrackerError: of the given kind; the version is newer, or no whole number.
    """
    version = check(data.get("version", newest), Annotated[int, Meta(ge=0)], f"{where}, 'version'", error_type)
    if version > newest:
        raise error_type(f"{where} has version {quoted(version)}, this program reads up to {newest}; upgrade quadrille")


def explain(error: msgspec.ValidationError, value: Any, declaration: Any) -> tuple[str, str]:
    """Return what was expected, with its key, and what was found.

    Args:
        error: that msgspec raised. A `__post_init__` raises ValueError("expected ..., found ...[; advice]").
        value: the data that does not fit.
        declaration: the type that it was to have.
    """
    parts = re.fullmatch(r"(.*?)(?: - at `\$([\w.\[\]]*)`)?", str(error), re.DOTALL)
    assert parts is not None, "any text has these parts"
    what, path = parts.groups("")
    trail = _trail(msgspec.inspect.type_info(declaration), value, path)
    at = trail[-1]
    if missing := re.fullmatch(r"Object missing required field `(.*)`", what):
        return f"the key '{missing[1]}'{_of(' in', at.key)}", "none"
    if unknown := re.fullmatch(r"Object contains unknown field `(.*)`", what, re.DOTALL):
        tag = [at.declared.tag_field] if at.declared.tag_field else []
        known = [*tag, *(f.encode_name for f in at.declared.fields)]
        return f"only {', '.join(known)} as keys{_of(' in', at.key)}", quoted(unknown[1])
    if what.startswith("expected "):
        expected, _, found = what.removeprefix("expected ").partition(", found ")
        return expected + _of(" in", at.key), found
    step = at
    for outer in reversed(trail):  # the numbers of a list are described with the list
        if step.description or isinstance(outer.declared, msgspec.inspect.StructType):
            break
        step = outer if outer.description else step
    found = "a number out of range" if what == "Number out of range" else quoted(step.value)
    name = next((s.title for s in reversed(trail) if s.title), step.key)
    return (step.description or _expectation(what, at.declared)) + _of(" as", name), found


def quoted(value: Any) -> str:
    """Return a short form of a value for a message."""
    try:
        text = repr(value)
    except ValueError:  # Python prints no integer of more than 4300 digits
        return "a number of thousands of digits"
    return text if len(text) <= 60 else f"{text[:57]}..."


class _Step(NamedTuple):
    """A value on the way from the whole to the wrong one."""

    key: str
    """Keys that lead to it. A list's item with a name goes by that: `joints[hinge].axes[bend].limits_deg`."""
    value: Any
    declared: Any
    """Its type, of `msgspec.inspect`."""
    description: str
    """Description of what is expected; empty if the declaration does not describe it."""
    title: str
    """Name of the field in which a user enters it; empty for what a file holds, whose keys the user sees."""


def _trail(declared: Any, value: Any, path: str) -> list[_Step]:
    """Follow a path such as `.joints[3].axes[0].name` through data and their declaration, as far as both go."""
    trail = [_Step("", value, *_resolve(declared, value))]
    for name, index in re.findall(r"\.([^.\[\]]+)|\[(\d+)\]", path):
        key, value, declared, *_ = trail[-1]
        column = declared.fields[int(index)].name if isinstance(declared, msgspec.inspect.NamedTupleType) else ""
        inner = _inner(declared, name, int(index or 0))
        try:
            value = value[name or int(index)]
        except (LookupError, TypeError):
            value = None  # the data cannot be followed, such as JSON with 1e400; the declaration can
        if inner is None:
            break
        title = value.get("name") if isinstance(value, dict) else None
        named = isinstance(title, str) and re.fullmatch(r"[\w .-]{1,40}", title)
        key += f".{name or column}" if name or column else f"[{title if named else index}]"
        trail.append(_Step(key.removeprefix("."), value, *_resolve(inner, value)))
    return trail


def _resolve(declared: Any, value: Any) -> tuple[Any, str, str]:
    """Return a type without its wrappers (of a union the member that looks like the value), description and title."""
    description = title = ""
    while isinstance(declared, msgspec.inspect.Metadata):
        schema = declared.extra_json_schema or {}
        description, title = schema.get("description", description), schema.get("title", title)
        declared = declared.type
    if isinstance(declared, msgspec.inspect.UnionType):
        members = [_resolve(member, value) for member in declared.types]
        like = [m for m in members if isinstance(m[0], _LISTS) == isinstance(value, list)]
        chosen = next((m for m in like if not isinstance(m[0], msgspec.inspect.NoneType)), members[0])
        declared, description, title = chosen[0], description or chosen[1], title or chosen[2]
    return declared, description, title


def _inner(declared: Any, name: str, index: int) -> Any:
    """Return the type of a field or item; None if the declaration has none."""
    if isinstance(declared, msgspec.inspect.StructType):
        return next((f.type for f in declared.fields if f.encode_name == name), None)
    if isinstance(declared, msgspec.inspect.NamedTupleType):
        return declared.fields[index].type
    if isinstance(declared, msgspec.inspect.TupleType):
        return declared.item_types[index] if index < len(declared.item_types) else None
    return getattr(declared, "item_type", None)


def _expectation(what: str, declared: Any) -> str:
    """Say what msgspec expected in the words of a person."""
    if isinstance(declared, msgspec.inspect.LiteralType):
        return f"one of {', '.join(map(repr, declared.values))}"
    if what == "Number out of range":
        return "a finite number"
    match = re.fullmatch(r"Expected `([^`]*)`(.*?)(?:, got .*)?", what, re.DOTALL)
    if match is None:
        return f"another value ({what})"
    kinds, limit = match.groups()
    return " or ".join(_WORDS.get(kind, kind) for kind in kinds.split(" | ")) + limit


def _of(preposition: str, key: str) -> str:
    return f"{preposition} '{key}'" if key else ""


_LISTS = (msgspec.inspect.ListType, msgspec.inspect.TupleType, msgspec.inspect.VarTupleType)
_WORDS = {
    "int": "a whole number", "float": "a number", "str": "text", "bool": "true or false", "array": "a list",
    "object": "a group of keys", "null": "nothing",
}  # fmt: skip
