"""Parse messages of a page, and explain what is wrong with one."""

import re
from collections.abc import Iterator
from typing import Any, get_args

import msgspec

from app.page.client_messages import CLIENT_MESSAGES, ClientMessage
from app.page.message_types import Command
from tracker.errors import TrackerError


class MessageError(TrackerError):
    """A message that the program does not understand."""

    def __init__(self, expected: str, found: str) -> None:
        """Say what was expected and what was found."""
        super().__init__(f"expected {expected}, found {found}; the page sent a wrong message, reload it")


def parse(data: str | bytes) -> ClientMessage:
    """Parse and check one text message of a page.

    Raises:
        MessageError: the message is not one of `CLIENT_MESSAGES`, or breaks a limit.
    """
    try:
        message: ClientMessage = _decoder_for(_HEAD.decode(data)).decode(data)
    except msgspec.ValidationError as error:
        raise MessageError(*_explained(str(error), data)) from error
    except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
        raise MessageError("a message in JSON", f"{len(data)} bytes that are not ({error})") from error
    return message


class _Head(msgspec.Struct):
    """The fields that decide which declaration a message has to fit."""

    type: str
    action: str | None = None


def _decoder_for(head: _Head) -> msgspec.json.Decoder[Any]:
    decoders = _DECODERS.get(head.type)
    if decoders is None:
        raise MessageError("a type of message that docs/protocol.md lists", _quoted(head.type))
    decoder = decoders.get(None) or decoders.get(head.action)
    if decoder is None:
        raise MessageError(f"{' or '.join(map(repr, decoders))} as action of '{head.type}'", _quoted(head.action))
    return decoder


def _cases(kind: type[Command]) -> Iterator[str | None]:
    """Yield the actions that a type of message stands for; None if it is alone with its `type`."""
    action = kind.__annotations__.get("action")
    alone = sum(other.__struct_config__.tag == kind.__struct_config__.tag for other in CLIENT_MESSAGES) == 1
    yield from (None,) if alone or action is None else get_args(action)


def _make_decoders() -> dict[str, dict[str | None, msgspec.json.Decoder[Any]]]:
    """Make a decoder of each message, by type and action. msgspec's own unions have one such field, not two."""
    decoders: dict[str, dict[str | None, msgspec.json.Decoder[Any]]] = {}
    for kind in CLIENT_MESSAGES:
        decoder = msgspec.json.Decoder(kind)
        decoders.setdefault(str(kind.__struct_config__.tag), {}).update(dict.fromkeys(_cases(kind), decoder))
    return decoders


_HEAD = msgspec.json.Decoder(_Head)
_DECODERS = _make_decoders()

_PATH = re.compile(r"(?P<what>.*?)(?: - at `\$\.?(?P<path>.*)`)?", re.DOTALL)


def _explained(error: str, data: str | bytes) -> tuple[str, str]:
    """Return what was expected and what was found, from the sentence of a validation error."""
    match = _PATH.fullmatch(error)
    what, path = (match["what"], match["path"] or "") if match else (error, "")
    if what.startswith("Object missing required field"):
        return f"a field {what.rpartition(' ')[2].strip('`')!r}", "a message without it"
    if what.startswith("Object contains unknown field"):
        return "no field beyond docs/protocol.md", repr(what.rpartition(" ")[2].strip("`"))
    of = f" as '{path}'" if path else ""
    if what.startswith("Number out of range"):
        return f"a finite number{of}", "one out of range"
    expected, _, got = what.partition(", got ")
    found = _quoted(_at(data, path)) if path or not got else got.strip("`")
    if expected.startswith("Expected "):
        return expected.removeprefix("Expected ").replace("`", "") + of, found
    return f"a value of docs/protocol.md{of}", found


def _at(data: str | bytes, path: str) -> Any:
    """Return the value at a path like `changes.passes[1]`."""
    try:
        value = msgspec.json.decode(data)
        for name, index in re.findall(r"([^.\[\]]+)|\[(\d+)\]", path):
            value = value[int(index)] if index else value[name]
    except (msgspec.DecodeError, LookupError, TypeError):
        return "what JSON cannot hold"
    return value


def _quoted(value: Any) -> str:
    """Return a short form of a value for a notice."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
