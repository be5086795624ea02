"""Parse messages of a page, explain what is wrong with one, and check what a role may send."""

from collections.abc import Iterator
from typing import Any, get_args

import msgspec

from app.messages import annotation as plan_wire
from app.messages import client as wire
from app.messages import inspector
from app.messages.base import Command
from app.messages.client import CLIENT_MESSAGES, ClientMessage
from app.messages.observation import UseObservations
from app.state.role import Role
from tracker.errors import TrackerError
from tracker.validation import explain, quoted

MISUNDERSTOOD = "expected a message that this program knows, found one of another version of the page; reload the page"
"""Notice of a page that has sent a wrong message. Its user typed none of it, so that only the log has the details."""
_SEEN: tuple[type[Command], ...] = (
    wire.SetView, wire.CheckEpipolar, wire.ShowCurves, wire.ShowHistory,
)  # fmt: skip
"""Subscriptions of one page alone."""
_MOVED: tuple[type[Command], ...] = (wire.Seek, wire.Select)
"""Change the frame and person that one participant sees, and nothing that is stored."""
_OF_HOST: tuple[type[Command], ...] = (
    inspector.SetHeight, inspector.SetPartSizes, inspector.SetGirdleWidth, inspector.ApplySizes, inspector.ChangeBody,
    inspector.DraftSizes, inspector.AcquireSizes, inspector.FindPeople, inspector.SetView3d, wire.CheckCalibration,
    wire.UseClocks, wire.EditFloor, wire.MarkFloor, wire.LookThrough, UseObservations,
)  # fmt: skip
"""Change what belongs to the session, not to a pose, or the 3-D view, which shows what the host shows."""
_DECIDED = ("verify", "reject")
"""Decisions of a review."""
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


def check_allowed(role: Role, message: Command, has_place: bool = True) -> None:
    """Check that a page may send a message.

    Args:
        role: of the page.
        message: as parsed.
        has_place: whether the page has a frame of its own, which it may leave.

    Raises:
        TrackerError: its role does not allow it.
    """
    if role == "host" or isinstance(message, _SEEN) or (has_place and isinstance(message, _MOVED)):
        return
    if role == "annotate":
        if isinstance(message, _OF_HOST):
            raise TrackerError(
                "expected the host's page to change bodies, cameras, the floor or the 3-D view, and to find people or "
                "use imported observations, found another; ask the host"
            )
        return
    if role == "review" and _is_review(message):
        return
    only = "look" if role == "look" else "look, mark poses as reviewed, decide on tasks and comment"
    raise TrackerError(f"expected a page that may annotate, found one that may only {only}; ask for another link")


def _is_review(message: Command) -> bool:
    if isinstance(message, wire.EditRange):
        return message.action in _REVIEWED
    if isinstance(message, plan_wire.DecideTask):
        return message.action in _DECIDED
    return isinstance(message, plan_wire.WriteComment | plan_wire.ResolveComment) or (
        isinstance(message, wire.ToggleMark) and message.toggle == "reviewed"
    )
