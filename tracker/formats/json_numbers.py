"""Find the numbers of a JSON text, to replace some and leave every other byte as it is."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

Span: TypeAlias = tuple[int, int]
"""Begin and end of a number in a text."""

_TOKEN = re.compile(r'[ \t\n\r]*("(?:[^"\\]|\\.)*"|[\[\]{}:,]|[^\s"\[\]{}:,]+)', re.DOTALL)
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")


@dataclass(frozen=True)
class SpanList:
    """A list of JSON."""

    items: list[Any]
    """Its items: a `Span` for a number, a `SpanList`, a dict, or None for text, true, false and null."""
    end: int
    """Place of its closing bracket."""


def json_spans(text: str) -> Any:
    """Return the structure of a JSON text that has been parsed before, with a `Span` for each number."""
    root: list[Any] = []
    stack: list[tuple[Any, str | None]] = [(root, None)]
    for match in _TOKEN.finditer(text, int(text.startswith("\ufeff"))):  # after a mark of the byte order
        token, (holder, key) = match[1], stack[-1]
        if token in "]}":
            stack.pop()
            if token == "]":
                outer, name = stack[-1]
                _put(outer, name, SpanList(holder, match.start(1)), replace_last=True)
        elif token in "{[":
            inner: Any = {} if token == "{" else []
            _put(holder, key, inner)
            stack.append((inner, None))
        elif token == ",":
            stack[-1] = (holder, None)
        elif token[0] == '"' and isinstance(holder, dict) and key is None:
            stack[-1] = (holder, json.loads(token))
        elif token != ":":
            _put(holder, key, match.span(1) if _NUMBER.fullmatch(token) else None)
    return root[0]


def _put(holder: Any, key: str | None, value: Any, replace_last: bool = False) -> None:
    if isinstance(holder, dict):
        holder[key] = value
    elif replace_last:
        holder[-1] = value
    else:
        holder.append(value)


def replace_spans(text: str, new: Mapping[Span, str]) -> str:
    """Return a text with some spans replaced; an empty span is an insertion."""
    parts, at = [], 0
    for (start, end), value in sorted(new.items()):
        parts += [text[at:start], value]
        at = end
    return "".join([*parts, text[at:]])
