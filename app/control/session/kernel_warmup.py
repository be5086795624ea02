"""Compile missing kernels while the page is open, in a separate process (`app.bench.compile_kernels`)."""

import logging
import subprocess
import sys
import threading
from collections.abc import Sequence

from app.control.session.session_state import SessionState
from tracker.compute.kernel_cache import compiled_mark

_LOG = logging.getLogger(__name__)
_POLL_S = 0.2

COMMAND = (sys.executable, "-m", "app.bench.compile_kernels", "--background")


class KernelWarmup:
    """Run the process that compiles the missing kernels, if there are any."""

    def __init__(self, session_state: SessionState, command: Sequence[str] = COMMAND) -> None:
        """Start compiling in the background unless all kernels are compiled.

        The process starts once the first frame has its cost. Until then the page's own process compiles the kernels
        for that cost and needs the processor.

        Args:
            session_state: the session's state; its `compiling` is set until all kernels are compiled.
            command: starts the process.
        """
        self._session_state, self._command = session_state, command
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        if not compiled_mark().exists():
            self._show(True)
            self._thread = threading.Thread(target=self._work, name="compiling", daemon=True)
            self._thread.start()

    def close(self) -> None:
        """End the process. The kernels that it has compiled stay in the cache."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()

    def _work(self) -> None:
        while self._session_state.state.cost_px is None:
            if self._closing.wait(_POLL_S):
                return
        # Ctrl+C in a terminal reaches the whole process group; only the page's process may end this one.
        with subprocess.Popen(self._command, start_new_session=True) as process:
            while process.poll() is None and not self._closing.wait(_POLL_S):
                pass
            if process.returncode is None:
                process.terminate()
            elif process.returncode:
                _LOG.warning(
                    "the kernels could not be compiled in the background; each is compiled when it is first needed"
                )
        self._show(False)

    def _show(self, compiling: bool) -> None:
        with self._session_state.lock:
            self._session_state.set(compiling=compiling)
