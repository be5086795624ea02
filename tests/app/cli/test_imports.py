"""Commands load what they need only: large packages take most of the time of a short command."""

import subprocess
import sys

import pytest
from command_line import SAMPLE

LARGE = {"numba", "scipy", "viser", "aiohttp", "trimesh"}
"""Packages that no summary of a session needs."""
INFO = """
import sys
from app.__main__ import main

sys.argv = ["quadrille", "info", *sys.argv[1:]]
main()
print(*sys.modules, file=sys.stderr)
"""


@pytest.mark.parametrize(("options", "unneeded"), [([], LARGE), (["--no-check"], LARGE | {"av"})])
def test_info_loads_no_kernels_and_no_decoder_it_does_not_use(options, unneeded):
    words = [sys.executable, "-c", INFO, str(SAMPLE), *options]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("elbow_rotation: 50 frames")
    assert unneeded & set(done.stderr.split()) == set()
