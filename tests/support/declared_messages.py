"""Messages to a page, checked against their declarations."""

import json

import msgspec

from app.messages.binary_headers import BINARY_HEADERS
from app.messages.server import TEXT_MESSAGES

_KINDS = {kind.__struct_config__.tag: kind for kind in (*TEXT_MESSAGES, *BINARY_HEADERS)}


def checked(text):
    """Return a message, or the header of a binary one, as an object; fail if it does not fit its declaration."""
    message = json.loads(text)
    msgspec.json.decode(text, type=_KINDS[message["type"]])
    return message
