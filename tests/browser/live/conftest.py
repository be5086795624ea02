"""Tests of the page against the program, which needs its kernels."""

import subprocess
import sys

import pytest


@pytest.fixture(scope="session", autouse=True)
def kernels():
    """Compile the kernels, or wait for another program that compiles them."""
    subprocess.run([sys.executable, "-m", "app.bench.compile_kernels"], check=True)
