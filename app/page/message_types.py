"""Bases of all messages of the pane socket, and types of values that several hold.

Positions are in undistorted pixels, frames count from 0, cameras and people are indices into the session's lists.
"""

from typing import Annotated, Literal, TypeAlias

import msgspec
from msgspec import Meta

MAX_INT = 2**31
_MAX_NUMBER = 1e9

Frame: TypeAlias = Annotated[int, Meta(ge=0, le=MAX_INT)]
Index: TypeAlias = Annotated[int, Meta(ge=0, le=MAX_INT)]
Number: TypeAlias = Annotated[float, Meta(ge=-_MAX_NUMBER, le=_MAX_NUMBER)]
Name: TypeAlias = Annotated[str, Meta(max_length=200)]

GesturePhase: TypeAlias = Literal["start", "move", "end", "cancel"]
Status: TypeAlias = Literal["", "good", "doubtful", "lost"]


class Command(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type"):
    """A message from a page."""


class Message(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type"):
    """A message to a page, or the header of a binary one."""


class Part(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A part of a message to a page."""
