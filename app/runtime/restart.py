"""Replace the process by the same program with other words."""

import os
import sys
from collections.abc import Sequence


def restart(words: Sequence[str]) -> None:
    """Start the program again in this process, with other words; does not return.

    Views work in daemon threads, and caches hold images. A new program has neither.

    Args:
        words: of the command line, without the name of the program.
    """
    own = len(sys.argv) - 1
    program = sys.orig_argv[1 : len(sys.orig_argv) - own]
    sys.stdout.flush()
    sys.stderr.flush()
    os.execv(sys.executable, [sys.executable, *program, *words])
