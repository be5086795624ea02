"""Follow the compilation of missing kernels: what the page shows waits for those that it needs."""

import logging
import threading

from app.control.session.session_state import SessionState
from app.runtime.kernel_compiler import KernelCompiler

_LOG = logging.getLogger(__name__)
_POLL_S = 0.1


class KernelWarmup:
    """Keeps the state's `compiled` up to date until all kernels are compiled."""

    def __init__(self, session_state: SessionState, compiler: KernelCompiler) -> None:
        """Start to watch, unless all kernels are compiled.

        Args:
            session_state: the session's state, made with the stages that the compiler had.
            compiler: the process to watch; closed with this.
        """
        self._session_state, self._compiler = session_state, compiler
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        if session_state.state.compiling or compiler.has_failed:
            self._thread = threading.Thread(target=self._work, name="compiling", daemon=True)
            self._thread.start()

    def close(self) -> None:
        """End the process. The kernels that it has compiled stay in the cache."""
        self._closing.set()
        self._compiler.close()
        if self._thread is not None:
            self._thread.join()

    def _work(self) -> None:
        session_state = self._session_state
        while session_state.state.compiling and not self._closing.wait(_POLL_S):
            stages = self._compiler.follow()
            if stages != session_state.state.compiled:
                session_state.note_compiled(stages)
            if "cost" not in stages:
                session_state.score_interpreted()
        if self._compiler.has_failed and not self._closing.is_set():
            _LOG.warning(
                "the kernels could not be compiled in the background; each is compiled when it is first needed"
            )
