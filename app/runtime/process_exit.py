"""End the process with the program's status."""

import atexit
import os
import signal
import stat
import sys
from collections.abc import Callable
from contextlib import suppress
from types import FrameType
from typing import NoReturn

from tracker.system import ENDING_SIGNALS

INTERRUPTED = 130
"""Status after SIGINT, as shells report it: 128 and the number of the signal."""


class TerminationError(KeyboardInterrupt):
    """A signal asked the program to end: work stops and cleans up as after Ctrl+C."""

    def __init__(self, number: int) -> None:
        """Note the signal."""
        super().__init__()
        self.status = 128 + number


def run(main: Callable[[], None]) -> None:
    """Run the program, and end the process with its status when all is closed. SIGTERM, and the end of the terminal,
    raise `TerminationError`.

    Views work in daemon threads. If one is inside OpenCV while Python finalizes, the process aborts instead of
    ending with its status.
    """
    status = 1  # unless it ends normally

    def end() -> None:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)

    for number in ENDING_SIGNALS:
        if signal.getsignal(number) != signal.SIG_IGN:  # nohup
            signal.signal(number, _terminate)
    atexit.register(end)  # the first function registered is called last
    try:
        main()
        status = 0
    except SystemExit as leaving:
        status = leaving.code if isinstance(leaving.code, int) else int(leaving.code is not None)
        raise


def _terminate(number: int, frame: FrameType | None) -> NoReturn:
    signal.signal(number, signal.SIG_DFL)  # a second one ends the process at once
    if number != signal.SIGTERM:
        _drop_terminal()
    raise TerminationError(number)


def _drop_terminal() -> None:
    """Discard further output to a terminal that has gone: what saves and cleans up may print."""
    nothing = os.open(os.devnull, os.O_WRONLY)
    for number in (1, 2):
        with suppress(OSError):
            if stat.S_ISCHR(os.fstat(number).st_mode):  # one that has gone is no terminal to `isatty`
                os.dup2(nothing, number)
    os.close(nothing)
