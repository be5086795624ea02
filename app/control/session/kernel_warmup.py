"""The controller's part that has kernels compiled beside the page, by a program of its own (`compile_kernels`)."""

import logging
import subprocess
import sys
import threading
from collections.abc import Sequence

from app.control.session.session_state import SessionState
from tracker.compute.kernel_cache import compiled_mark

_LOG = logging.getLogger(__name__)
_LOOK_S = 0.2

COMMAND = (sys.executable, "-m", "app.bench.compile_kernels")


class Compiling:
    """Watches over the program that compiles, where there is something to compile."""

    def __init__(self, screen: SessionState, command: Sequence[str] = COMMAND) -> None:
        """Have everything compiled in the background, unless it is.

        The program starts when the first frame has its cost: until then the page's own program compiles what that
        needs, and should have the processor.

        Args:
            screen: is told until all is compiled.
            command: of the program.
        """
        self._screen, self._command = screen, command
        self._over = threading.Event()
        self._thread: threading.Thread | None = None
        if not compiled_mark().exists():
            self._tell(True)
            self._thread = threading.Thread(target=self._work, name="compiling", daemon=True)
            self._thread.start()

    def close(self) -> None:
        """End the program; what it has compiled by now is kept."""
        self._over.set()
        if self._thread is not None:
            self._thread.join()

    def _work(self) -> None:
        while self._screen.state.cost_px is None:
            if self._over.wait(_LOOK_S):
                return
        # Ctrl+C in a terminal goes to a whole group: it is for the page's program, which ends this one.
        with subprocess.Popen(self._command, start_new_session=True) as process:
            while process.poll() is None and not self._over.wait(_LOOK_S):
                pass
            if process.returncode is None:
                process.terminate()
            elif process.returncode:
                _LOG.warning("the kernels could not be compiled beside the page; each is when it is needed")
        self._tell(False)

    def _tell(self, compiling: bool) -> None:
        with self._screen.lock:
            self._screen.set(compiling=compiling)
