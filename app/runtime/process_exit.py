"""End the process with the program's status."""

import atexit
import os
import signal
import sys
from collections.abc import Callable
from types import FrameType
from typing import NoReturn

INTERRUPTED, TERMINATED = 130, 143
"""Status after SIGINT and SIGTERM, as shells report them."""


class TerminationError(KeyboardInterrupt):
    """SIGTERM arrived: work stops and cleans up as after Ctrl+C."""


def run(main: Callable[[], None]) -> None:
    """Run the program, and end the process with its status when all is closed. SIGTERM raises `TerminationError`.

    Views work in daemon threads. If one is inside OpenCV while Python finalizes, the process aborts instead of
    ending with its status.
    """
    status = 1  # unless it ends normally

    def end() -> None:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)

    signal.signal(signal.SIGTERM, _terminate)
    atexit.register(end)  # the first function registered is called last
    try:
        main()
        status = 0
    except SystemExit as leaving:
        status = leaving.code if isinstance(leaving.code, int) else int(leaving.code is not None)
        raise


def _terminate(number: int, frame: FrameType | None) -> NoReturn:
    signal.signal(number, signal.SIG_DFL)  # a second one ends the process at once
    raise TerminationError
