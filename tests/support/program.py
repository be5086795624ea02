"""A real program on a real session, as a user starts it."""

import asyncio
import contextlib
import os
import sys
from collections.abc import AsyncGenerator
from pathlib import Path

from page_driver import shows

ROOT = Path(__file__).resolve().parents[2]
SAMPLE = ROOT / "sample_sessions" / "elbow_rotation"
N_ROLES = 3
"""Links of `--share`."""


class Program:
    """`quadrille open SESSION` in a process of its own. Without a token a page finds it again after a restart."""

    def __init__(
        self,
        session: Path | None,
        *options: str,
        hears_errors: bool = False,
        has_token: bool = False,
        log: Path | None = None,
        main: tuple[str, ...] = ("-m", "quadrille"),
    ) -> None:
        """Prepare it.

        Args:
            session: folder to open; None for the bundled sample, as `quadrille` alone does.
            options: more words of the command line.
            hears_errors: keep its standard error in `errors` when it has ended.
            has_token: require the token.
            log: file that its standard error is written to.
            main: how Python runs the command line.
        """
        self._hears_errors, self._log = hears_errors, log
        self.errors = ""
        self._words = [sys.executable, *main, "open", *([str(session)] if session else []), "--no-browser"]
        self._words += options
        if not has_token:
            self._words.append("--no-token")
        self._process: asyncio.subprocess.Process | None = None
        self.address = ""
        self.links: dict[str, str] = {}
        """Addresses for other people by role, with `--share`."""

    @property
    def pid(self) -> int:
        """Number of its process."""
        return self._process.pid

    @property
    def status(self) -> int | None:
        """How its process has ended; None while it runs."""
        return self._process.returncode

    async def start(self, port: int = 0) -> None:
        """Start it at a port; 0 takes a free one."""
        with open(self._log or os.devnull, "ab") as log:
            heard = asyncio.subprocess.PIPE if self._hears_errors else None
            self._process = await asyncio.create_subprocess_exec(
                *self._words,
                "--port",
                str(port),
                cwd=ROOT,
                stdout=asyncio.subprocess.PIPE,
                stderr=log if self._log else heard,
                env={**os.environ, "PYTHONUNBUFFERED": "1"},
            )
        async with asyncio.timeout(120):
            while not self.address:
                line = (await self._process.stdout.readline()).decode()
                assert line, "the program ended before it served the page"
                if ": http://127.0.0.1" in line and "viser" not in line.lower():
                    self.address = line.partition(": ")[2].strip()
            while "--share" in self._words and len(self.links) < N_ROLES:
                role, _, address = (await self._process.stdout.readline()).decode().strip().partition(": ")
                self.links[role.removeprefix("to ")] = address

    async def kill(self) -> None:
        """End it at once, as a crash would."""
        with contextlib.suppress(ProcessLookupError):
            self._process.kill()
        await self._process.wait()
        self.address = ""

    async def ended(self) -> int:
        """Wait for its end; returns its status."""
        _, errors = await asyncio.wait_for(self._process.communicate(), 60)
        self.errors = (errors or b"").decode()
        return self._process.returncode

    async def stop(self) -> None:
        """End it as Ctrl+C does."""
        with contextlib.suppress(ProcessLookupError):
            self._process.terminate()
        await asyncio.wait_for(self._process.wait(), 30)
        self.address = ""


AT_REST = """async () => {
  const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
  while (!document.querySelector("#scene")?.contentDocument?.querySelector("canvas")) await pause(50);
  await pause(9000);
}"""
"""Until the 3-D view has faded in and rests beside other work (static/scene/pause.js): before, where no graphics card
draws, it may keep the page from doing anything else for seconds."""


WITHOUT_3D = """Object.defineProperty(HTMLIFrameElement.prototype, "src", { set() {}, get: () => "about:blank" })"""
"""Leaves the 3-D view empty: it takes much of a machine without a graphics card. (A route would turn the cache off.)"""

READY = "window.quadrille?.state.overlay && quadrille.state.state?.cost_px !== null"
"""That a page shows its first cost, for `shows`."""


@contextlib.asynccontextmanager
async def started(session: Path, *options: str, **how) -> AsyncGenerator[Program, None]:
    """A running program, killed in the end; `how` as `Program` takes it."""
    program = Program(session, *options, **how)
    try:
        await program.start()
        yield program
    finally:
        await program.kill()


@contextlib.asynccontextmanager
async def visited(browser, address, size=(1280, 720), viser=False):
    """The page of a program with its first cost on the screen, and an empty 3-D view unless it is wanted.

    Fails where the page reports an error.
    """
    context = await browser.new_context(viewport={"width": size[0], "height": size[1]}, color_scheme="dark")
    try:
        page = await context.new_page()
        page.errors = []
        page.on("pageerror", lambda error: page.errors.append(str(error)))
        if not viser:
            await page.add_init_script(WITHOUT_3D)
        await page.goto(address, timeout=120_000)
        await page.wait_for_url(lambda url: "token" not in url)  # the page leaves it in a cookie
        await shows(page, READY, 180)
        if viser:
            await page.evaluate(AT_REST)
        yield page
    finally:
        await context.close()
    assert page.errors == []


async def visit_again(page, address):
    """Open the page in a tab of `visited`, without what the page had stored."""
    await page.goto(address + "static/icon.svg")
    await page.mouse.up()
    for key in ("Shift", "Control"):
        await page.keyboard.up(key)
    await page.evaluate("localStorage.clear(), sessionStorage.clear()")
    await page.goto(address)
    await shows(page, READY, 180)
