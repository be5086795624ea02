"""End the process with the program's status."""

import atexit
import os
import sys
from collections.abc import Callable


def run(main: Callable[[], None]) -> None:
    """Run the program, and end the process with its status when all is closed.

    Views work in daemon threads. If one is inside OpenCV while Python finalizes, the process aborts instead of
    ending with its status.
    """
    status = 1  # unless it ends normally

    def end() -> None:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)

    atexit.register(end)  # the first function registered is called last
    try:
        main()
        status = 0
    except SystemExit as leaving:
        status = leaving.code if isinstance(leaving.code, int) else int(leaving.code is not None)
        raise
