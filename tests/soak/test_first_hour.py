"""A stranger's first hour with a recording of their own, in the browser: from no session to an exported file.

The stranger makes a session in the page's form, places everybody by drags, searches and fits, tracks, corrects lost and
doubtful stretches, changes the sizes of the bodies, reviews and exports. They see what the screen shows: where a joint
appears in a picture, 3 px off. The references only judge. Any error in the console, in a request or in the program's
log fails the test. `QUADRILLE_SOAK=1` takes the whole recordings, otherwise their beginning. To run it alone:
`QUADRILLE_SOAK=1 python -m pytest -m slow tests/soak/test_first_hour.py`. `QUADRILLE_PICTURES=FOLDER` keeps a picture
of each stage.
"""

import os
from pathlib import Path

import numpy as np
import pytest
from chromium import FLAGS, chromium_path
from page_driver import shows, state_of
from playwright.async_api import async_playwright
from program import READY, WITHOUT_3D, Program
from scripted_user import TRUNK, ScriptedUser
from stranger import Errors, Stranger, table

from tracker.errors import FormatError
from tracker.evaluation.metrics import evaluate_joints
from tracker.evaluation.references import read_joints, stored_motion
from tracker.formats.joint_maps import joints_of
from tracker.formats.trc import read_trc
from tracker.session.session import load_session
from tracker.store.stored_poses import read_stored_poses

RECORDINGS = {
    "balance_real": {"person": "reference_joints.trc"},
    "two_people": {"man": "ground_truth_person1.trc", "woman": "ground_truth_person2.trc"},
}
"""The people of each recording, and their references."""
LIMBS = [
    f"{side}_{joint}"
    for limb in (("knee", "ankle"), ("elbow", "wrist"))
    for side in ("left", "right")
    for joint in limb
    for _ in range(2)
]
ORDER = ["torso", "torso", "left_shoulder", "right_shoulder", *LIMBS]
"""What is dragged to place a person, from the trunk outwards, each in the next view."""
MOST_ACTIONS, PLACED_MM, FITTED_MM = 20, 60, 48
TILTS = 3
"""At most so many drags tilt a body that does not stand upright."""
STRETCHES = 3
OFF_PX = 8
"""A joint that looks further off than this on the screen is corrected, CSS px."""
CORRECTED = 4
"""At most so many joints of a frame are corrected, each in two views."""
SHORT = 12
"""Frames of a recording that a short run takes."""
WORK_S = 900
SEED = 5
GUTTER_PX, PADDING_PX = 52, 8
"""What of the timeline is left and right of its frames."""
DONE = (
    "!quadrille.state.state.job.running && !quadrille.state.state.track.running && !quadrille.state.state.range.running"
)


class Hour:
    """One recording, its stranger, and what a judge knows of it."""

    def __init__(self, stranger, data, folder, people, n_frames):
        self.stranger, self.page = stranger, stranger.page
        self.data, self.folder, self.people = data, folder, people
        self.n_frames = n_frames
        """Number of frames that are tracked; None for all."""
        self.truths = [data / name for name in people.values()]
        self.pictures = os.environ.get("QUADRILLE_PICTURES")

    @property
    def session(self):
        return load_session(self.folder)

    @property
    def last(self):
        """The last frame to be tracked."""
        n = self.session.n_frames
        return (n if self.n_frames is None else min(n, self.n_frames)) - 1

    def user(self, frame, person):
        """What the stranger sees on a frame."""
        session = self.session
        views = range(len(session.cameras))
        return ScriptedUser(session, self.truths[person], frame, SEED + frame, views, person)

    def judged(self, frames):
        """Error and state of the stored poses, for a row of the table."""
        session = self.session
        errors, lost, counts = [], 0, {"doubtful": 0, "lost": 0}
        for person, truth in enumerate(self.truths):
            reference = read_joints(truth, session.fps)
            try:
                found = evaluate_joints(stored_motion(session, person).joints, reference, frames)
                errors.append(f"{found.mpjpe_mm:.0f}")
                lost += found.lost_frames
            except FormatError:  # no pose yet
                errors.append("–")
            who = session.people[person]
            for pose in read_stored_poses(session.annotations_path, who.name, who.model).values():
                if pose.record.status in counts and not (pose.record.reviewed or pose.record.keyframe):
                    counts[pose.record.status] += 1
        return {
            "error, mm": " / ".join(errors), "doubtful": str(counts["doubtful"]), "lost": str(counts["lost"]),
            "truly lost": str(lost),
        }  # fmt: skip

    async def picture(self, name):
        """Keep a picture of the page."""
        if self.pictures:
            path = Path(self.pictures) / self.data.name / f"{len(self.stranger.stages):02} {name}.png"
            path.parent.mkdir(parents=True, exist_ok=True)
            await self.page.screenshot(path=path, timeout=120_000)

    async def notices(self):
        """Messages of the page, newest first."""
        rows = "[...document.querySelectorAll('#notice-log-list li')]"
        return await self.page.evaluate(f"{rows}.map((li) => [li.className, li.lastChild.textContent])")


async def make_session(hour):
    """Fill the form of a new session, and open the session."""
    stranger, page = hour.stranger, hour.page
    with stranger.stage("new session") as stage:
        await hour.picture("first page")
        await stranger.press("Control+o")
        await hour.picture("sessions")
        await stranger.click("#show-new-session")
        await stranger.fill("#new-footage", str(hour.data))
        await stranger.fill("#new-calibration", str(hour.data / "Calib.toml"))
        await stranger.fill("#new-folder", str(hour.folder))
        await stranger.fill("#new-people", ", ".join(hour.people))
        await stranger.fill("#new-background", str(hour.data / "background"))
        await hour.picture("form")
        await stranger.click("#make-session")
        await stranger.until("!document.querySelector('#make-session').disabled", 60)
        await hour.picture("checks")
        checks = await page.locator("#new-session-checks li").all_inner_texts()
        failed = await page.locator("#new-session-checks .is-failed").all_inner_texts()
        assert not failed, failed
        stage.result["remark"] = f"{len(checks)} checks"
        async with page.expect_event("load", timeout=60_000):
            await stranger.click("#open-made-session")
        await stranger.until(READY, 180)
        await hour.picture("opened")


async def place(hour):
    """Place everybody on frame 0 by drags, and search and fit."""
    stranger = hour.stranger
    for person, name in enumerate(hour.people):
        with stranger.stage(f"place {name}") as stage:
            if len(hour.people) > 1:
                await stranger.click(f"#people label[title^='Select {name} ']")
                await stranger.until(f"quadrille.state.state.person === {person}")
            user, turn = hour.user(0, person), 0
            views = len(hour.session.cameras)
            for joint in ORDER:
                if joint == "left_shoulder":
                    for _ in range(TILTS):
                        if not await stranger.tilt(user, person):
                            break
                for _ in range(views):
                    camera, turn = turn % views, turn + 1
                    missed = stage.missed
                    if joint == "torso":
                        await stranger.move_trunk(user, camera, person)
                    else:
                        await stranger.drag(camera, joint, user.aim_px(joint, camera), person)
                    if stage.missed == missed:
                        break
            await hour.picture(f"placed {name}")
            stage.result |= hour.judged([0])
    for name, key, work in (("search (F)", "f", "search"), ("fit (G)", "g", "fit")):
        with stranger.stage(name) as stage:
            await stranger.press(key)
            await stranger.until(
                f"quadrille.state.state.compared?.work === '{work}' && {DONE} && quadrille.state.state.saved", 240
            )
            stage.result |= hour.judged([0])
            await hour.picture(name)


async def track(hour, name="track"):
    """Track from frame 0."""
    stranger = hour.stranger
    with stranger.stage(name) as stage:
        await stranger.go_to(0)
        if hour.n_frames is not None:
            await mark(hour, 0, hour.last)
        await stranger.click("#track-forward")
        await stranger.until("quadrille.state.state.track.running", 60)
        await hour.picture("tracking")
        await stranger.until(f"{DONE} && quadrille.state.state.saved", WORK_S)
        if hour.n_frames is not None:
            await stranger.click("#range-close")
        stage.result |= hour.judged(range(hour.last + 1))
        await hour.picture("tracked")


async def mark(hour, first, last):
    """Mark a range on the timeline."""
    box = await hour.page.locator("#timeline").bounding_box()
    n = hour.session.n_frames
    left, width = box["x"] + GUTTER_PX, box["width"] - GUTTER_PX - PADDING_PX
    x = [round(left + width * (frame + 0.5) / n) for frame in (first, last)]
    y = box["y"] + box["height"] / 3
    hour.stranger.stages[-1].mouse += 1
    await hour.page.keyboard.down("Shift")
    await hour.page.mouse.move(x[0], y)
    await hour.page.mouse.down()
    await hour.page.mouse.move(x[1], y, steps=4)
    await hour.page.mouse.up()
    await hour.page.keyboard.up("Shift")
    await hour.stranger.until(f"quadrille.state.range?.first === {first} && quadrille.state.range.last === {last}")


async def track_within(hour, button, first, last):
    """Track a marked range by its bar, and unmark it."""
    if first < last:
        await mark(hour, first, last)
        await hour.stranger.click(button)
        await hour.stranger.until("quadrille.state.state.range.running || quadrille.state.state.track.running", 60)
        await hour.stranger.until(f"{DONE} && quadrille.state.state.saved", WORK_S)
        await hour.stranger.click("#range-close")


async def correct(hour):
    """Correct the worst stretches of the list, each by drags on its worst frame and by tracking from there."""
    stranger = hour.stranger
    for k in range(1, STRETCHES + 1):
        with stranger.stage(f"correct {k}") as stage:
            if (await state_of(hour.page))["drawer"] != "doubts":
                await stranger.press("Shift+L")
            await stranger.until("quadrille.state.drawer === 'doubts'")
            if k == 1:
                await hour.picture("doubts")
            rows = hour.page.locator("#doubt-list .doubt")
            if not await rows.count():
                stage.result["remark"] = "none left"
                await hour.picture("no doubts")
                continue
            text = (await rows.first.inner_text()).split("\n")
            frames = next(line for line in text if line.startswith("frame")).partition(" ")[2]
            first, last = (int(n) for n in (frames.split("–") * 2)[:2])
            await stranger.click("#doubt-list .doubt >> nth=0")
            await stranger.until("quadrille.state.overlay.frame === quadrille.state.target")
            await stranger.until(SETTLED_FRAME)
            state = await state_of(hour.page)
            frame, person = state["target"], state["state"]["person"]
            stage.result["remark"] = f"{', '.join(text[:-1])}, {frames}"
            await correct_frame(hour, frame, person)
            await hour.picture("corrected")
            await stranger.press("g")
            await stranger.until(
                f"/fit/i.test(quadrille.state.state.undo ?? '') && {DONE} && quadrille.state.state.saved"
            )
            await track_within(hour, "#range-forward", frame, last)
            await track_within(hour, "#range-backward", first, frame)
            stage.result |= hour.judged(range(hour.last + 1))
            await hour.picture("tracked again")


SETTLED_FRAME = (
    "quadrille.state.state.frame === quadrille.state.target && quadrille.state.shown.frame === quadrille.state.target"
)


async def correct_frame(hour, frame, person):
    """Drag the joints that look off by much, the worst first, each in the two views that show it best."""
    stranger, user = hour.stranger, hour.user(frame, person)
    views = range(len(hour.session.cameras))
    done = set()
    for _ in range(CORRECTED):
        seen = await stranger.seen_off(user, views, person)
        trunk = [np.mean([seen[n, c][0] for n in TRUNK if (n, c) in seen]) for c in views]
        if "torso" not in done and max(trunk) > OFF_PX:
            done.add("torso")
            for camera in np.argsort(trunk)[:-3:-1]:
                await stranger.move_trunk(user, int(camera), person)
            continue
        left = {key: off for key, (off, _) in seen.items() if key[0] not in done}
        joint, _ = max(left, key=left.__getitem__)
        if max(off for key, off in left.items()) < OFF_PX:
            return
        done.add(joint)
        n_dragged = 0
        for camera in sorted(views, key=lambda c: -left.get((joint, c), 0)):
            n_dragged += await stranger.drag(camera, joint, seen[joint, camera][1], person)
            if n_dragged == 2:
                break


async def change_sizes(hour):
    """Give each person their height in the inspector, apply it, and fit frame 0 again."""
    stranger = hour.stranger
    changes = []
    with stranger.stage("sizes") as stage:
        await stranger.go_to(0)
        await stranger.press("Alt+i")
        for person, name in enumerate(hour.people):
            if len(hour.people) > 1:
                await stranger.click(f"#people label[title^='Select {name} ']")
            await stranger.until(f"quadrille.state.bodySizes?.person === {person}")
            height_m = (await state_of(hour.page))["bodySizes"]["height_m"]
            known_m = known_height(hour, person, height_m)
            changes.append(f"{name} {height_m:.2f} → {known_m:.2f} m")
            field = "#inspector [data-section=body] .row:has-text('Height') input"
            await stranger.fill(field, f"{100 * known_m:.0f}")
            await stranger.press("Enter")
            await stranger.until("quadrille.state.bodySizes.edited")
            await hour.picture(f"sizes of {name}")
            await stranger.click("#inspector [data-section=body] button:has-text('Apply')")
            await stranger.until("!quadrille.state.bodySizes.edited && quadrille.state.state.saved")
        stage.result["remark"] = ", ".join(changes)
        await stranger.press("Alt+i")
        await stranger.press("g")
        await stranger.until(f"/fit/i.test(quadrille.state.state.undo ?? '') && {DONE} && quadrille.state.state.saved")
        stage.result |= hour.judged([0])
        await hour.picture("sizes applied")


def known_height(hour, person, height_m):
    """The height that a person would give, metres: their limbs in proportion to those of the body."""
    session = hour.session
    model = session.people[person].model
    truth = read_joints(hour.truths[person], session.fps)
    at = {n: truth.points[:, i] for i, n in enumerate(truth.names)}
    body = dict(zip(model.point_names, model.points_world(model.neutral()), strict=True))
    bones = [(f"{s}_{a}", f"{s}_{b}") for s in ("left", "right") for a, b in (("hip", "knee"), ("knee", "ankle"))]
    bones += [
        (f"{s}_{a}", f"{s}_{b}") for s in ("left", "right") for a, b in (("shoulder", "elbow"), ("elbow", "wrist"))
    ]
    true = sum(np.nanmedian(np.linalg.norm(at[a] - at[b], axis=1)) for a, b in bones)
    return height_m * true / sum(np.linalg.norm(body[a] - body[b]) for a, b in bones)


async def review(hour):
    """Step through the frames, accept or fit what is still in doubt, and export."""
    stranger, page = hour.stranger, hour.page
    with stranger.stage("review") as stage:
        await stranger.press("Home")
        for _ in range(hour.last // 10):
            await stranger.press("Shift+.")
            await stranger.until(SETTLED_FRAME)
        if (await state_of(page))["drawer"] != "doubts":
            await stranger.press("Shift+L")
        rows = page.locator("#doubt-list .doubt")
        accepted = fitted = 0
        while n := await rows.count():
            await stranger.press("Alt+ArrowDown")
            await stranger.until(SETTLED_FRAME)
            state = await state_of(page)
            user = hour.user(state["target"], state["state"]["person"])
            seen = await stranger.seen_off(user, range(len(hour.session.cameras)), state["state"]["person"])
            if max(off for off, _ in seen.values()) > OFF_PX and fitted < STRETCHES:
                fitted += 1
                await stranger.press("g")
                await stranger.until("/fit/i.test(quadrille.state.state.undo ?? '') && quadrille.state.state.saved")
            else:
                accepted += 1
                await stranger.press("Alt+Enter")
                await stranger.until(f"document.querySelectorAll('#doubt-list .doubt').length < {n}")
        stage.result |= hour.judged(range(hour.last + 1)) | {"remark": f"{accepted} entries accepted, {fitted} fitted"}
        await hour.picture("reviewed")
        await stranger.press("Shift+L")
    with stranger.stage("export") as stage:
        await stranger.click("#show-export")
        errors = []
        for person, name in enumerate(hour.people):
            await stranger.choose("#export-format", "trc")
            if len(hour.people) > 1:
                await stranger.choose("#export-person", name)
            await hour.picture("export")
            async with page.expect_download() as download:
                await stranger.click("#export-start")
            path = hour.folder.parent / f"{name}.trc"
            await (await download.value).save_as(path)
            session = hour.session
            exported = joints_of(read_trc(path), str(path))
            truth = read_joints(hour.truths[person], session.fps)
            errors.append(f"{evaluate_joints(exported, truth, range(hour.last + 1)).mpjpe_mm:.0f}")
        await hour.picture("exported")
        stage.result["error, mm"] = " / ".join(errors)


@pytest.mark.slow
@pytest.mark.parametrize("recording", RECORDINGS)
async def test_a_stranger_gets_through_the_first_hour(recording, tmp_path, data_folder, cases, report, monkeypatch):
    for name in ("STATE", "DATA"):
        monkeypatch.setenv(f"XDG_{name}_HOME", str(tmp_path / name.lower()))
    n_frames = None if cases(100) >= 100 else SHORT
    log = tmp_path / "program.log"
    program = Program(None, has_token=True, log=log)
    async with (
        async_playwright() as playwright,
        await playwright.chromium.launch(executable_path=chromium_path(), args=FLAGS) as browser,
    ):
        context = await browser.new_context(viewport={"width": 1280, "height": 720}, color_scheme="dark")
        page = await context.new_page()
        if not os.environ.get("QUADRILLE_3D"):
            await page.add_init_script(WITHOUT_3D)
        errors, stranger = Errors(page), Stranger(page)
        hour = Hour(stranger, data_folder(recording), tmp_path / "session", RECORDINGS[recording], n_frames)
        try:
            await program.start()
            await page.goto(program.address, timeout=120_000)
            await shows(page, READY, 180)
            for part in (make_session, place, track, correct, change_sizes, review):
                await part(hour)
        finally:
            report(f"{recording}\n{table(stranger.stages)}")
            try:
                report("\n".join(" ".join(line) for line in await hour.notices()))
            finally:
                await context.close()
                await program.stop()
                report("\n".join(errors.found) + "\n" + log.read_text("utf-8"))
    assert errors.found == []
    assert log.read_text("utf-8") == ""
    assert program.status == 0
