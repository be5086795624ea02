"""Bases of all messages of the pane socket, types of values that several hold, and their encoding.

Positions are in undistorted pixels, frames count from 0, cameras and people are indices into the session's lists.
"""

import struct
from typing import Annotated, Any, Literal, TypeAlias, TypeVar

import msgspec
import numpy as np
from msgspec import Meta

MAX_INT = 2**31
_MAX_NUMBER = 1e9

Frame: TypeAlias = Annotated[int, Meta(ge=0, le=MAX_INT)]
Index: TypeAlias = Annotated[int, Meta(ge=0, le=MAX_INT)]
Number: TypeAlias = Annotated[float, Meta(ge=-_MAX_NUMBER, le=_MAX_NUMBER)]
Name: TypeAlias = Annotated[str, Meta(max_length=200)]
Dofs: TypeAlias = Annotated[list[Index], Meta(min_length=1, max_length=1000)]

GesturePhase: TypeAlias = Literal["start", "move", "end", "cancel"]
Status: TypeAlias = Literal["", "good", "doubtful", "lost"]


class Command(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type"):
    """A message from a page."""


class Message(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type"):
    """A message to a page, or the header of a binary one."""


class WorkMessage(Message, frozen=True):
    """Work in the background: its progress, or how the last one ended."""

    running: bool
    stage: str
    """The kind of work."""
    share: float
    """Share of the present step that is done, 0 to 1."""
    message: str
    """How the last one ended, or empty."""
    failed: bool
    """Whether it ended with an error."""


class Part(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A part of a message to a page."""


M = TypeVar("M", bound=Message | Part)


def made_of(kind: type[M], source: object, /, **others: Any) -> M:
    """Return a message, or a part of one, whose fields are the attributes of that name, but for some others."""
    return kind(**{f: getattr(source, f) for f in kind.__struct_fields__ if f not in others}, **others)


def encode_text(message: Message) -> str:
    """Return the JSON text of a message; NaN becomes null."""
    return _ENCODER.encode(message).decode()


def encode_binary(header: Message, payload: bytes) -> bytes:
    """Return `[uint32 LE length of the header][header: JSON, UTF-8][payload]`."""
    head = _ENCODER.encode(header)
    return struct.pack("<I", len(head)) + head + payload


def _plain(value: Any) -> Any:
    """Return a numpy scalar as a Python one."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"messages hold no {type(value)}")


_ENCODER = msgspec.json.Encoder(enc_hook=_plain)
