"""Encode messages to the page."""

import struct
from typing import Any

import msgspec
import numpy as np

from app.page.message_types import Message


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
