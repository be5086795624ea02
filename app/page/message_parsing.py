"""Parse messages of a page, explain what is wrong with one, and check what a role may send."""

from collections.abc import Iterator
from typing import Any, get_args

import msgspec

from app.page import client_messages as wire
from app.page.client_messages import CLIENT_MESSAGES, ClientMessage
from app.page.message_types import Command
from app.state.role import Role
from tracker.errors import TrackerError
from tracker.validation import explain, quoted

MISUNDERSTOOD = "expected a message that this program knows, found one of another version of the page; reload the page"
"""Notice of a page that has sent a wrong message. Its user typed none of it, so that only the log has the details."""
_SEEN: tuple[type[Command], ...] = (
    wire.SetView, wire.CheckEpipolar, wire.ShowCurves, wire.ShowHistory,
)  # fmt: skip
"""Subscriptions of one page alone. A page that may only look sees the frame that the annotator works on."""
_MOVED: tuple[type[Command], ...] = (wire.Seek, wire.Select)
"""All pages show one frame and person, which a review moves too."""
_REVIEWED = ("reviewed", "unreviewed")
"""Marks that a review may set on a range."""


class MessageError(TrackerError):
    """A message that the program does not understand, by its keys: for the log, not for the page."""

    def __init__(self, expected: str, found: str) -> None:
        """Say what was expected and what was found."""
        super().__init__(f"expected {expected}, found {found}")


def parse(data: str | bytes) -> ClientMessage:
    """Parse and check one text message of a page.

    Raises:
        MessageError: the message is not one of `CLIENT_MESSAGES`, or breaks a limit.
    """
    decoder = _HEAD
    try:
        decoder = _decoder_for(_HEAD.decode(data))
        message: ClientMessage = decoder.decode(data)
    except msgspec.ValidationError as error:
        raise MessageError(*explain(error, _value(data), decoder.type)) from error
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
        raise MessageError("a type of message that docs/protocol.md lists", quoted(head.type))
    decoder = decoders.get(None) or decoders.get(head.action)
    if decoder is None:
        raise MessageError(f"{' or '.join(map(repr, decoders))} as action of '{head.type}'", quoted(head.action))
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


_HEAD: msgspec.json.Decoder[Any] = msgspec.json.Decoder(_Head)
_DECODERS = _make_decoders()


def _value(data: str | bytes) -> Any:
    """Return a message as plain data; None if only a part of it is JSON that Python can hold."""
    try:
        return msgspec.json.decode(data)
    except (msgspec.DecodeError, UnicodeError, RecursionError):
        return None


def check_allowed(role: Role, message: Command) -> None:
    """Check that a page may send a message.

    Raises:
        TrackerError: its role does not allow it.
    """
    if role == "annotate" or isinstance(message, _SEEN) or (role == "review" and _is_review(message)):
        return
    only = "look" if role == "look" else "look and mark poses as reviewed"
    raise TrackerError(f"expected a page that may annotate, found one that may only {only}; ask for another link")


def _is_review(message: Command) -> bool:
    if isinstance(message, wire.EditRange):
        return message.action in _REVIEWED
    return isinstance(message, _MOVED) or (isinstance(message, wire.ToggleMark) and message.toggle == "reviewed")
