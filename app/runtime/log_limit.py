"""Keep the log short: one sentence for what strangers can cause, and few lines of a kind."""

import errno
import logging
import time
from collections import OrderedDict
from typing import NamedTuple

_MOST, _WITHIN_S = 3, 60.0
"""Largest number of messages of a kind, and within which time: enough to see that something repeats."""
_MAX_KINDS = 100
"""Number of kinds remembered."""
_NO_DESCRIPTORS = (errno.EMFILE, errno.ENFILE)


class _Kind(NamedTuple):
    """Messages of one kind since a moment."""

    since_s: float
    passed: int = 0
    left_out: int = 0


class LogLimit(logging.Filter):
    """Passes at most `_MOST` messages of a kind in `_WITHIN_S`; the next one says how many were left out.

    A request that cannot be parsed, a peer that is gone and a lack of file descriptors are no faults of the program:
    they get a sentence instead of a traceback. Anyone who reaches the port could fill the disk with tracebacks.
    """

    def __init__(self) -> None:
        """Begin without messages."""
        super().__init__()
        self._kinds: OrderedDict[tuple[object, ...], _Kind] = OrderedDict()

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether to show a record; shortens it."""
        error = record.exc_info[1] if record.exc_info else None
        text = _sentence(error)
        if text is not None:
            record.msg, record.args, record.exc_info, record.exc_text = text, (), None, None
        first_line = str(record.msg).partition("\n")[0]
        key = (record.name, first_line, type(error))
        now_s = time.monotonic()
        kind = self._kinds.pop(key, _Kind(now_s))
        left_out = 0
        if now_s >= kind.since_s + _WITHIN_S:
            left_out, kind = kind.left_out, _Kind(now_s)
        is_shown = kind.passed < _MOST
        self._kinds[key] = kind._replace(passed=kind.passed + is_shown, left_out=kind.left_out + (not is_shown))
        while len(self._kinds) > _MAX_KINDS:
            self._kinds.popitem(last=False)
        if left_out:
            record.msg, record.args = f"{record.getMessage()} ({left_out} more like this were left out)", ()
        return is_shown


def limit_log() -> None:
    """Show warnings and errors of the process on standard error, limited."""
    handler = logging.StreamHandler()
    handler.setLevel(logging.WARNING)
    handler.addFilter(LogLimit())
    logging.getLogger().addHandler(handler)


def _sentence(error: BaseException | None) -> str | None:
    """Return what to say in the place of a traceback; None where the traceback is wanted."""
    if isinstance(error, OSError) and error.errno in _NO_DESCRIPTORS:
        return (
            "expected a free file descriptor, found all in use: new connections wait; close other pages, or allow more "
            "by ulimit -n"
        )
    if isinstance(error, ConnectionError):
        return "a connection ended before its answer was sent"
    if type(error).__module__ == "aiohttp.http_exceptions":
        return f"a request was refused, because it is not well-formed HTTP ({type(error).__name__})"
    return None
