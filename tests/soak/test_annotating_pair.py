"""An annotator and a reviewer make a verified dataset of two people, each in a browser: plan, drags, verdicts, export.

Both see the true joints in the views, some pixels off, and nothing else. `QUADRILLE_SOAK=1` goes on for an hour: with
denser plans, up to every frame, and then with poses that the reviewer picks to be looked at again. Run it by
`QUADRILLE_SOAK=1 python -m pytest -m slow tests/soak/test_annotating_pair.py`.
"""

import json
import os
import subprocess
import sys
import time
from contextlib import asynccontextmanager

import numpy as np
import pytest
from chromium import FLAGS, chromium_path
from page_driver import OPENED, command, drags_of, handle_of, shows, to_client, until
from playwright.async_api import async_playwright
from program import ROOT, WITHOUT_3D, Program
from scripted_user import LIMBS, ScriptedUser

from tracker.evaluation.references import read_joints
from tracker.formats.trc import read_trc
from tracker.session.session import load_session

pytestmark = pytest.mark.slow

PEOPLE = ("person1", "person2")
HOUR_S = 3600.0
LAST_ROUND_S = 300.0
"""Left for a last round of poses that are looked at again."""
EVERY = (20, 10, 5, 2, 1)
"""Frames between planned ones, plan after plan."""
CORRECTED_PX, REJECTED_PX = 9.0, 18.0
"""The annotator drags a joint that seems farther off in a view, the reviewer rejects it: 3 and 6 times their noise."""
OFF_MM = 100.0
COUNTER = "document.querySelector('.plan-counter b')?.textContent"
N_FRAMES = 60
IS_OFF, LOOK_AGAIN = " is off", "look_again"
APART_PX = 6.0
"""A joint nearer to another one cannot be grabbed for certain."""


def quadrille(*words):
    done = subprocess.run(
        [sys.executable, "-m", "quadrille", *map(str, words)],
        cwd=ROOT, capture_output=True, text=True, env={**os.environ, "QUADRILLE_ANNOTATOR": "Anna"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout) if "--json" in words else done.stdout


@pytest.fixture(scope="module")
def truths(data_folder):
    data = data_folder("two_people")
    return {name: data / f"ground_truth_{name}.trc" for name in PEOPLE}


@pytest.fixture(scope="module")
def folder(data_folder, truths, tmp_path_factory):
    """The recording, tracked from its first frame."""
    data, at = data_folder("two_people"), tmp_path_factory.mktemp("pair") / "session"
    videos, calibration = sorted(data.glob("*.mp4")), data / "Calib.toml"
    quadrille(
        *("new", at, "--calibration", calibration, "--background", data / "background"),
        *("--people", *PEOPLE, "--videos", *videos),
    )
    for name, truth in truths.items():
        quadrille("init", at, "--joints", truth, "--person", name)
        quadrille("acquire", at, "--person", name)
    quadrille("track", at)
    return at


class Eye:
    """A person before a page, who sees how far the joints of a pose are off in each view."""

    def __init__(self, page, sent, session, truths, seed):
        self.page, self._sent, self._session, self._truths, self._seed = page, sent, session, truths, seed

    async def off_px(self, frame, person):
        """By joint and view: how far a joint must go, undistorted px. Joints are there for all views that see them."""
        self._seed += 1
        views = range(len(self._session.cameras))
        truth = self._truths[PEOPLE[person]]
        user = ScriptedUser(self._session, truth, frame, self._seed, views, person)
        shown = {
            (h["point"], h["camera"]): np.array([h["u"], h["v"]])
            for h in await self.page.evaluate("quadrille.state.overlay.handles")
            if h["person"] == person
        }
        out = {}
        for joint in LIMBS:
            seen = {v: user.aim_px(joint, v) - shown[joint, v] for v in views if (joint, v) in shown}
            out[joint] = {v: off for v, off in seen.items() if np.isfinite(off).all()}
        return out

    async def drag(self, joint, person, view, off_px):
        """Drag a joint in a view. Returns whether it was that joint that was grabbed; another one is taken back."""
        u, v = await handle_of(self.page, view, joint, person)
        await self.page.mouse.move(*await to_client(self.page, view, u, v))
        n_before = len(self._sent)
        await self.page.mouse.down()
        for share in (0.3, 0.7, 1.0):
            await self.page.mouse.move(*await to_client(self.page, view, u + share * off_px[0], v + share * off_px[1]))
        await self.page.mouse.up()
        try:
            await until(lambda: any(m["phase"] == "end" for m in self._sent[n_before:]), 5)
        except TimeoutError:
            return False  # nothing was grabbed: too short a way is a click
        last = self._sent[-1]
        await shows(self.page, f"quadrille.state.overlay.seq >= {last['seq']} && quadrille.state.state.saved", 30)
        is_meant = (last["point"], last["person"]) == (joint, person)
        if not is_meant:
            await self.page.keyboard.press("Control+z")
            await shows(self.page, "quadrille.state.state.saved", 30)
        return is_meant

    async def free_views(self, joint, person):
        """Views in which a joint can be grabbed for certain, as far from others as can be."""
        handles = await self.page.evaluate("quadrille.state.overlay.handles")
        at = {(h["camera"], h["point"], h["person"]): np.array([h["u"], h["v"]]) for h in handles}
        room = {}
        for view in range(len(self._session.cameras)):
            own = at.get((view, joint, person))
            if own is not None:
                others = (p for k, p in at.items() if k[0] == view and k[1:] != (joint, person))
                room[view] = min((np.hypot(*(p - own)) for p in others), default=0.0)
        return sorted((v for v in room if room[v] > APART_PX), key=lambda v: -room[v])[:2]


def worst_px(off):
    return max((float(np.hypot(*px)) for px in off.values()), default=0.0)


@asynccontextmanager
async def chromium():
    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(executable_path=chromium_path(), args=FLAGS)
        yield browser
        await browser.close()


@asynccontextmanager
async def opened(browser, address, errors):
    """A page in a browser of its own, and the drags that it sends."""
    context = await browser.new_context(viewport={"width": 1440, "height": 900}, accept_downloads=True)
    await context.add_init_script(WITHOUT_3D)
    page = await context.new_page()
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda m: errors.append(m.text) if m.type == "error" else None)
    sent = drags_of(page)
    try:
        await page.goto(address)
        await page.wait_for_url(lambda url: "token" not in url)  # the page leaves it in a cookie
        await shows(page, OPENED, 120)
        yield page, sent
    finally:
        await context.close()


POSE_SHOWN = "[quadrille.state.state.frame, quadrille.state.state.person]"


async def at_task(page, left=None):
    """Frame and person of the listed task that the page shows, once it has left another pose where that is given."""
    await shows(
        page,
        f"document.querySelector('.plan-tasks [aria-current]') && '{left or ''}' !== {POSE_SHOWN}.join() "
        "&& quadrille.state.overlay?.frame === quadrille.state.state.frame "
        "&& quadrille.state.shown?.frame === quadrille.state.state.frame",
        30,
    )
    return await page.evaluate(POSE_SHOWN)


async def next_task(page):
    """Go to the next listed task; return its frame and person."""
    n = await page.locator(".plan-tasks button").count()
    is_listed = await page.locator(".plan-tasks [aria-current]").count()
    left = ",".join(map(str, await page.evaluate(POSE_SHOWN)))
    await page.keyboard.press("Alt+t")
    return await at_task(page, None if is_listed and n == 1 else left)


async def plan(page, every):
    section = page.locator("[data-section=annotation]")
    field = section.get_by_label("N", exact=True)
    if not await field.is_visible():
        await section.get_by_text("Plan frames").click()
    await field.fill(str(every))
    await section.get_by_label("Of", exact=True).select_option(label="everybody")
    await section.get_by_role("button", name="Plan", exact=True).click()
    await page.evaluate("document.activeElement.blur()")
    denser = EVERY[: EVERY.index(every) + 1]
    n = len(PEOPLE) * sum(any(k % step == 0 for step in denser) for k in range(N_FRAMES))
    await shows(page, f"quadrille.state.annotation?.tasks.length === {n}", 30)


async def listed(page, kind):
    await page.locator("[data-section=annotation]").get_by_label("Tasks to list").select_option(kind)
    await page.evaluate("document.activeElement.blur()")
    more = page.locator(".plan-tasks + button")
    if await more.is_visible():
        await more.click()
        await page.evaluate("document.activeElement.blur()")
    return await page.locator(".plan-tasks button").count()


async def state_at(page, frame, person):
    """State and comment of the task of a pose, as a page shows it."""
    return await page.evaluate(
        f"(({{ state, comment }}) => [state, comment])(quadrille.state.annotation.tasks.find("
        f"(task) => task.frame === {frame} && task.person === {person}))"
    )


async def annotate(eye, kinds):
    """Go through the listed tasks and correct what is seen to be off."""
    for kind in kinds:
        for _ in range(await listed(eye.page, kind)):
            frame, person = await next_task(eye.page)
            state, comment = await state_at(eye.page, frame, person)
            seen = await eye.off_px(frame, person)
            told = comment.removesuffix(IS_OFF).replace(" ", "_") if state == "rejected" else None
            if told == LOOK_AGAIN:
                told = max(seen, key=lambda joint: worst_px(seen[joint]))
            for joint, off in seen.items():
                if joint == told or worst_px(off) > CORRECTED_PX:
                    for view in await eye.free_views(joint, person):
                        now = (await eye.off_px(frame, person))[joint]
                        if view in now:
                            await eye.drag(joint, person, view, now[view])
            if not await eye.page.evaluate(f"quadrille.state.lanes[{person}].get({frame})?.keyframe ?? false"):
                await eye.page.keyboard.press("k")
            await shows(eye.page, "quadrille.state.state.saved", 30)


async def up_to_date(page, folder):
    """Wait until a page shows the tasks of the store: those that another page has done arrive a little later."""
    tasks = quadrille("tasks", folder, "--json")["tasks"]
    stored = {f"{t['frame']},{PEOPLE.index(t['person'])}": t["state"] for t in tasks}
    await shows(
        page,
        "quadrille.state.annotation.tasks.every((task) => "
        f"({json.dumps(stored)})[`${{task.frame}},${{task.person}}`] === task.state)",
        30,
    )


async def review(eye):
    """Accept poses, or reject them with the joint that is off. Returns the number of verdicts."""
    n = await listed(eye.page, "review")
    task = await next_task(eye.page) if n else None
    for left in range(n, 0, -1):
        frame, person = task
        off = await eye.off_px(frame, person)
        worst = max(off, key=lambda joint: worst_px(off[joint]))
        if worst_px(off[worst]) <= REJECTED_PX:
            await eye.page.keyboard.press("Alt+k")
        else:
            await command(eye.page, "Reject the planned pose")
            await eye.page.keyboard.type(worst.replace("_", " ") + IS_OFF)
            await eye.page.keyboard.press("Enter")
        await shows(eye.page, f"document.querySelectorAll('.plan-tasks button').length === {left - 1}", 30)
        if left > 1:  # the page goes to the next one by itself
            task = await at_task(eye.page, f"{frame},{person}")
    return n


async def look_again(eye, n, rng):
    """Reject poses that are picked from all, so that they are looked at once more."""
    await listed(eye.page, "all")
    for _ in range(n):
        for _ in range(rng.integers(1, 9)):
            frame, person = await next_task(eye.page)
        await command(eye.page, "Reject the planned pose")
        await eye.page.keyboard.type(LOOK_AGAIN.replace("_", " "))
        await eye.page.keyboard.press("Enter")
        await shows(
            eye.page,
            f"quadrille.state.annotation.tasks.some((task) => task.frame === {frame} && task.person === {person} "
            "&& task.state === 'rejected')",
            30,
        )


async def exported(page, person, to):
    """Joints of the reviewed poses of a person, as the page exports them."""
    await page.click("#show-export")
    await page.select_option("#export-format", "trc")
    await page.select_option("#export-person", person)
    await page.select_option("#export-only", "reviewed")
    async with page.expect_download() as download:
        await page.click("#export-start")
    await (await download.value).save_as(to)
    await page.keyboard.press("Escape")
    return read_trc(to)


async def to_and_fro(anna, rita, folder):
    """Correct and review until no pose is left, a few times at most. Returns how often."""
    n = 0
    while n < 4:
        n += 1
        await up_to_date(anna.page, folder)
        await annotate(anna, ("open",))
        await up_to_date(rita.page, folder)
        if not await review(rita):
            break
    return n


async def test_a_pair_makes_a_verified_dataset(folder, truths, tmp_path, cases, report):
    session, errors, log = load_session(folder), [], tmp_path / "log.txt"
    before = {
        p: quadrille("evaluate", folder, "--reference", t, "--person", p, "--json")["mpjpe_mm"]
        for p, t in truths.items()
    }
    program = Program(folder, "--annotator", "Anna", "--share", has_token=True, log=log)
    begin, seconds, rounds, rng = time.monotonic(), cases(HOUR_S), 0, np.random.default_rng(3)
    try:
        await program.start()
        async with (
            chromium() as browser,
            opened(browser, program.address, errors) as (page, sent),
            opened(browser, program.links["review"], errors) as (second, second_sent),
        ):
            await command(second, "People on this session, and your name")
            await second.keyboard.type("Rita")
            await second.keyboard.press("Enter")
            await shows(second, "quadrille.state.presence?.name === 'Rita' && quadrille.state.connected")
            await second.keyboard.press("Escape")
            anna, rita = Eye(page, sent, session, truths, 1), Eye(second, second_sent, session, truths, 1000)
            for one in (page, second):
                await command(one, "Plan, tasks and comments")
            for every in EVERY:
                await plan(page, every)
                rounds += await to_and_fro(anna, rita, folder)
                if time.monotonic() - begin > seconds:
                    break
            while time.monotonic() - begin < seconds - LAST_ROUND_S:
                await look_again(rita, 12, rng)
                rounds += await to_and_fro(anna, rita, folder)
            counter = await page.evaluate(COUNTER)
            files = {p: await exported(page, p, tmp_path / f"{p}.trc") for p in PEOPLE}
    finally:
        await program.kill()
    assert errors == []
    assert "Traceback" not in log.read_text()
    done, planned = (int(n) for n in counter.split()[:3:2])
    found = quadrille("tasks", folder, "--json")
    assert {t["by"] for t in found["tasks"] if t["state"] == "verified"} == {"Rita"}
    error_mm = {}
    for name, file in files.items():
        truth = read_joints(truths[name], session.fps)
        verified = [t["frame"] for t in found["tasks"] if t["person"] == name and t["state"] == "verified"]
        mine, theirs = ([o.names.index(j) for j in LIMBS] for o in (file, truth))
        off = 1e3 * np.linalg.norm(file.points[verified][:, mine] - truth.points[verified][:, theirs], axis=-1)
        assert np.isfinite(off).all(), "each verified frame is in the export"
        assert np.mean(off > OFF_MM) < 0.01
        error_mm[name] = round(float(off.mean()), 1)
    minutes = (time.monotonic() - begin) / 60
    report(
        f"{counter} in {rounds} rounds and {minutes:.1f} min, off by {error_mm} mm, tracked: {before}, {found['speed']}"
    )
    assert done >= 0.9 * planned
