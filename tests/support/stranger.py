"""A stranger at the page: acts by mouse and keys, takes what is on the screen, and is counted and watched.

An action is one press to release of the mouse, one key, or one field filled by typing.
"""

import time
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from page_driver import command, drags_of, handle_of, shows, state_of, to_client, until
from scripted_user import LIMBS, TRUNK

NEAR_ENOUGH_PX = 4
"""A way shorter than this on the screen is a click, CSS px."""
SETTLED = "!quadrille.state.dragging && quadrille.state.state.saved && quadrille.state.connected"
LEANS_RAD = np.radians(25)
"""A body that leans otherwise by more than this in a view is tilted."""
IN_FULL = 0.35
"""Where the two sides of the trunk are together shorter than this part of the person, it is seen from its end, and
nobody judges how it leans."""
MOVED = 6
"""Steps of the mouse in a drag."""


@dataclass
class Stage:
    """What one part of the hour took."""

    name: str
    mouse: int = 0
    keys: int = 0
    seconds: float = 0.0
    missed: int = 0
    """Number of drags that the stranger could not begin: another joint was under the pointer."""
    result: dict[str, str] = field(default_factory=dict)


class Errors:
    """What goes wrong without anybody being told: in the console, in requests, and as messages of the page."""

    def __init__(self, page):
        self.found = []
        page.on("pageerror", lambda error: self.found.append(f"exception: {error}"))
        page.on("console", self._hear)
        page.on("requestfailed", self._fail)
        page.on("response", lambda r: r.status >= 400 and self.found.append(f"status {r.status}: {r.url}"))
        page.on("crash", lambda _: self.found.append("the page crashed"))

    def _hear(self, message):
        if message.type in ("error", "warning"):
            where = (message.location or {}).get("url", "")
            self.found.append(f"console {message.type}: {message.text} ({where})")

    def _fail(self, request):
        # A page that is left, and a picture that another has replaced, end their own requests.
        if request.failure != "net::ERR_ABORTED":
            self.found.append(f"request failed, {request.failure}: {request.url}")


class Stranger:
    """Hands and eyes at a page, whose actions are counted by stage."""

    def __init__(self, page):
        self.page, self.stages, self._sent = page, [], drags_of(page)

    @contextmanager
    def stage(self, name) -> Generator[Stage, None, None]:
        """Count and time what is done within."""
        stage = Stage(name)
        self.stages.append(stage)
        began = time.monotonic()
        try:
            yield stage
        finally:
            stage.seconds = time.monotonic() - began

    async def click(self, selector, **options):
        """Click what is visible."""
        self.stages[-1].mouse += 1
        await self.page.locator(selector).click(timeout=20_000, **options)

    async def press(self, key):
        """Press a key."""
        self.stages[-1].keys += 1
        await command(self.page, key)

    async def fill(self, selector, text):
        """Type a text into a field, which is clicked first."""
        await self.click(selector)
        self.stages[-1].keys += 1
        await self.page.keyboard.press("Control+a")
        await self.page.keyboard.type(text)

    async def choose(self, selector, value):
        """Choose an option."""
        self.stages[-1].mouse += 1
        await self.page.locator(selector).select_option(value)

    async def until(self, expression, timeout_s=60.0):
        """Wait until the page shows something."""
        await shows(self.page, expression, timeout_s)

    async def go_to(self, frame):
        """Type the number of a frame, unless it is shown."""
        if (await state_of(self.page))["shown"]["frame"] != frame:
            await self.fill("#frame", str(frame))
            await self.page.keyboard.press("Enter")
        await self.until(f"quadrille.state.shown.frame === {frame} && quadrille.state.overlay.frame === {frame}")
        await self.until(SETTLED)

    async def zoom_to_people(self):
        """Zoom every view to the people: in whole images a pixel of the screen is centimetres of the room."""
        await self.press("Zoom all views to the people")
        await self.until("true")

    async def drag(self, camera, point, to_px, person=0, key=None):
        """Drag a joint to a place in a view, in undistorted px; whole pixels of the screen, as a mouse has them.

        Holds a key meanwhile if one is given. Returns whether the joint was dragged: not if it is there already, or
        cannot be taken in this view.
        """
        page = self.page
        start = np.round(await to_client(page, camera, *await handle_of(page, camera, point, person)))
        end = np.round(await to_client(page, camera, *to_px))
        if np.hypot(*(end - start)) < NEAR_ENOUGH_PX:
            return False
        await page.mouse.move(*(start + 1))
        await page.mouse.move(*start)
        if not await self._takes(camera, point, person):
            self.stages[-1].missed += 1
            return False
        self.stages[-1].mouse += 1
        n_sent = len(self._sent)
        if key:
            await page.keyboard.down(key)
        await page.mouse.down()
        for step in range(1, MOVED + 1):
            await page.mouse.move(*(start + step / MOVED * (end - start)))
        await page.mouse.up()
        if key:
            await page.keyboard.up(key)
        try:
            await until(lambda: any(message["phase"] == "end" for message in self._sent[n_sent:]))
        except TimeoutError:
            under = await page.evaluate("([x, y]) => document.elementFromPoint(x, y)?.outerHTML", start.tolist())
            phases = [message["phase"] for message in self._sent[n_sent:]]
            raise AssertionError(
                f"the drag of {point} in view {camera} from {start} to {end} has no end, only {phases}; "
                f"at its start is {under}"
            ) from None
        await self.until(f"quadrille.state.overlay.seq === {self._sent[-1]['seq']} && {SETTLED}")
        return True

    async def _takes(self, camera, point, person):
        """Whether a press takes the joint, as the name at the pointer says; asks for the next of a pair."""
        for _ in range(4):
            await self.until("true")
            hover = (await state_of(self.page))["hover"]
            if hover is None:
                return False
            if (hover["camera"], hover["point"], hover["person"]) == (camera, point, person):
                return True
            wanted = {"person": person, "point": point}
            if wanted not in hover.get("overlapping", []):
                return False
            await self.press("Take the next of the joints that overlap under the pointer")
        return False

    async def seen_off(self, user, cameras, person=0):
        """How far each limb joint looks off in each view, CSS px, and where it should be, undistorted px."""
        handles = {
            (h["point"], h["camera"]): (h["u"], h["v"])
            for h in await self.page.evaluate("quadrille.state.overlay.handles")
            if h["person"] == person
        }
        aims = {(joint, camera): user.aim_px(joint, camera) for camera in cameras for joint in LIMBS}
        aims = {key: aim for key, aim in aims.items() if np.isfinite(aim).all()}
        places = [[key[1], *place] for key, aim in aims.items() for place in (aim.tolist(), handles[key])]
        shown = await self.page.evaluate("(all) => all.map(([c, u, v]) => quadrille.toClient(c, u, v))", places)
        xy = np.array([[at["x"], at["y"]] for at in shown]).reshape(-1, 2, 2)
        off = np.linalg.norm(xy[:, 0] - xy[:, 1], axis=1)
        return {key: (float(px), aim) for (key, aim), px in zip(aims.items(), off, strict=True)}

    async def tilt(self, user, person=0):
        """Tilt the body, in the view that shows best that it leans otherwise; returns whether it did."""
        turns = {}
        for camera in user.views:
            drawn, seen = await self._trunk_axes(user, camera, person)
            aims = np.array([user.aim_px(n, camera) for n in LIMBS])
            size = np.max(np.nanmax(aims, axis=0) - np.nanmin(aims, axis=0))
            if min(np.hypot(*drawn), np.hypot(*seen)) > IN_FULL * size:
                turns[camera] = float(np.arctan2(drawn[0] * seen[1] - drawn[1] * seen[0], drawn @ seen))
        camera = max(turns, key=lambda c: abs(turns[c]), default=None)
        if camera is None or abs(turns[camera]) < LEANS_RAD:
            return False
        c, s = np.cos(turns[camera]), np.sin(turns[camera])
        middle = np.array(await handle_of(self.page, camera, "torso", person))
        at = np.array(await handle_of(self.page, camera, "left_shoulder", person))
        to = middle + np.array([[c, -s], [s, c]]) @ (at - middle)
        return await self.drag(camera, "left_shoulder", to, person, key="Shift")

    async def _trunk_axes(self, user, camera, person):
        """The lines from hips to shoulders in a view, undistorted px: of the body as drawn, and of the person."""
        seen = {n: user.aim_px(n, camera) for n in TRUNK}
        drawn = {n: np.array(await handle_of(self.page, camera, n, person)) for n in TRUNK}
        return [sum(at[n] * (1 if n.endswith("shoulder") else -1) for n in TRUNK) for at in (drawn, seen)]

    async def move_trunk(self, user, camera, person=0):
        """Drag the square by as much as shoulders and hips look off."""
        off = [user.aim_px(n, camera) - np.array(await handle_of(self.page, camera, n, person)) for n in TRUNK]
        at = await handle_of(self.page, camera, "torso", person)
        return await self.drag(camera, "torso", np.add(at, np.nanmean(off, axis=0)), person)


def table(stages):
    """The stages as a table in Markdown."""
    heads = list(dict.fromkeys(key for stage in stages for key in stage.result))
    rows = [["stage", "mouse", "keys", "s", *heads]]
    rows += [
        [s.name, str(s.mouse), str(s.keys), f"{s.seconds:.0f}", *(s.result.get(head, "") for head in heads)]
        for s in stages
    ]
    lines = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([lines[0], "|---|" + "---:|" * (len(rows[0]) - 1), *lines[1:]])
