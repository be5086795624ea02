"""Compile missing kernels in a process of their own (`app.bench.compile_kernels`) while the program starts and runs."""

import subprocess
from collections.abc import Sequence

from tracker.compute.kernel_cache import STAGES, compiled_stages, is_compiled
from tracker.compute.uncompiled_kernels import interpret_modules
from tracker.system import end_apart, own_module, start_detached

COMMAND = (*own_module("app.bench.compile_kernels"), "--background")
_POSING = "posing"


class KernelCompiler:
    """The process that compiles the missing kernels, if there are any."""

    def __init__(self, command: Sequence[str] = COMMAND) -> None:
        """Start the process unless all kernels are compiled. This program interprets those that place a body meanwhile.

        Args:
            command: starts the process.
        """
        self._process: subprocess.Popen[bytes] | None = None
        if not is_compiled():
            # Ctrl+C in a terminal reaches all that it started; only this program may end the process.
            self._process = start_detached(command)
            if _POSING not in compiled_stages():
                interpret_modules("tracker.body.kinematics")

    @property
    def has_failed(self) -> bool:
        """Whether the process ended without all kernels. Each is then compiled when it is first needed."""
        return self._process is not None and bool(self._process.poll())

    @property
    def stages(self) -> frozenset[str]:
        """The stages whose kernels can be called without delay; all of them once the process has ended."""
        has_ended = self._process is None or self._process.poll() is not None
        return frozenset(STAGES) if has_ended else compiled_stages()

    def follow(self) -> frozenset[str]:
        """Return the `stages`; kernels that were interpreted because they were missing are loaded from now on."""
        stages = self.stages
        if _POSING in stages:
            interpret_modules()
        return stages

    def close(self) -> None:
        """End the process and what it has started. The kernels that it has compiled stay in the cache."""
        if self._process is not None and self._process.poll() is None:
            end_apart(self._process)
        interpret_modules()
