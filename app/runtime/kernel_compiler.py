"""Compile missing kernels in a process of their own (`app.bench.compile_kernels`) while the program starts and runs."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress

from tracker.compute.kernel_cache import STAGES, compiled_stages, is_compiled

COMMAND = (sys.executable, "-m", "app.bench.compile_kernels", "--background")
_POLL_S = 0.02


class KernelCompiler:
    """The process that compiles the missing kernels, if there are any."""

    def __init__(self, command: Sequence[str] = COMMAND) -> None:
        """Start the process unless all kernels are compiled.

        Args:
            command: starts the process.
        """
        self._process: subprocess.Popen[bytes] | None = None
        if not is_compiled():
            # Ctrl+C in a terminal reaches the whole process group; only this program may end the process.
            self._process = subprocess.Popen(command, start_new_session=True)

    @property
    def has_failed(self) -> bool:
        """Whether the process ended without all kernels. Each is then compiled when it is first needed."""
        return self._process is not None and bool(self._process.poll())

    @property
    def stages(self) -> frozenset[str]:
        """The stages whose kernels can be called without delay; all of them once the process has ended."""
        if self._process is None or self._process.poll() is not None:
            return frozenset(STAGES)
        return compiled_stages()

    def wait_for(self, stage: str) -> None:
        """Wait until the kernels of a stage are compiled or the process has ended.

        For kernels that the caller would have to compile at once, beside the process that is at it.
        """
        while stage not in self.stages:
            time.sleep(_POLL_S)

    def close(self) -> None:
        """End the process and what it has started. The kernels that it has compiled stay in the cache."""
        if self._process is not None and self._process.poll() is None:
            with suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGTERM)
            self._process.wait()
