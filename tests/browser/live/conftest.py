"""Tests of the page against the program, which needs its kernels."""

import shutil

import pytest
import pytest_asyncio
from program import SAMPLE, started, visited


@pytest.fixture(scope="session", autouse=True)
def compiled(kernels):
    """The program under test does not wait for its kernels."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A copy of the sample."""
    return shutil.copytree(SAMPLE, tmp_path_factory.mktemp("live") / "session")


@pytest_asyncio.fixture(loop_scope="session", scope="module")
async def program(folder):
    """The program on a folder, for all tests of a module that start none of their own."""
    async with started(folder) as running:
        yield running


@pytest_asyncio.fixture(loop_scope="session", scope="module")
async def tab(browser, program):
    """Its page, for `visit_again`."""
    async with visited(browser, program.address) as page:
        yield page
