"""One recording of a first hour: what its stranger sees, and how a judge who knows the truth finds the result."""

import json
import os
from pathlib import Path

import numpy as np
from page_driver import drag_mouse, frame_place, state_of
from scripted_user import TRUNK, ScriptedUser

from tracker.errors import FormatError
from tracker.evaluation.metrics import evaluate_joints
from tracker.evaluation.references import read_joints, stored_motion
from tracker.session.session import load_session
from tracker.session.store.stored_poses import read_stored_poses

SEED = 5
LIMB_ENDS = {
    "Upper arm": ("shoulder", "elbow"), "Forearm": ("elbow", "wrist"),
    "Thigh": ("hip", "knee"), "Calf": ("knee", "ankle"),
}  # fmt: skip
UPRIGHT_DEG = 20
"""A person who leans by less stands upright."""
OFF_PX = 8
"""A joint that looks further off than this on the screen is corrected, CSS px."""
CORRECTED = 4
"""At most so many joints of a frame are corrected, each in two views."""
DONE = (
    "!quadrille.state.state.job.running && !quadrille.state.state.track.running "
    "&& !quadrille.state.state.range.running && quadrille.state.state.saved"
)
WORK_S = 900
"""Longest time of one piece of work."""


class Hour:
    """One recording, its stranger, and what a judge knows of it."""

    def __init__(self, stranger, data, folder, people, n_frames):
        self.stranger, self.page = stranger, stranger.page
        self.data, self.folder, self.people = data, folder, people
        self._n_frames = n_frames
        """Number of frames that are worked on; None for all."""
        self.start = 0
        """The frame on which the people are placed."""
        self.truths = [data / name for name in people.values()]
        self.pictures = os.environ.get("QUADRILLE_PICTURES")

    @property
    def session(self):
        return load_session(self.folder)

    @property
    def frames(self):
        """The frames that are worked on."""
        n = self.session.n_frames
        return range(n) if self._n_frames is None else range(self.start, min(n, self.start + self._n_frames))

    @property
    def is_whole(self):
        """Whether the whole recording is worked on."""
        return self._n_frames is None

    def looks_upright(self, frame):
        """Whether everybody is seen to stand on a frame."""
        return self.lean_deg(frame) < UPRIGHT_DEG

    def lean_deg(self, frame):
        """How much the person leans who leans most, degrees."""
        leans = []
        for truth in self.truths:
            joints = read_joints(truth, self.session.fps)
            at = dict(zip(joints.names, joints.points[frame], strict=True))
            trunk = sum(at[n] * (1 if n.endswith("shoulder") else -1) for n in TRUNK)
            leans.append(np.degrees(np.arccos(trunk[2] / np.linalg.norm(trunk))))
        return max(leans)

    def user(self, frame, person):
        """What the stranger sees on a frame."""
        return ScriptedUser(self.session, self.truths[person], frame, SEED + frame, self.views, person)

    @property
    def views(self):
        """Indices of the cameras."""
        return range(len(self.session.cameras))

    def errors_mm(self, frames):
        """Mean error of each person over frames that have poses."""
        session = self.session
        return [
            evaluate_joints(stored_motion(session, person).joints, read_joints(truth, session.fps), frames).mpjpe_mm
            for person, truth in enumerate(self.truths)
        ]

    def judged(self, frames=None):
        """Error and state of the stored poses, for a row of the table."""
        session, frames = self.session, self.frames if frames is None else frames
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
        """Sentences of the line of advice, newest first."""
        rows = "[...document.querySelectorAll('#advice-log-list li')]"
        return await self.page.evaluate(f"{rows}.map((li) => [li.className, li.lastChild.textContent])")

    async def choose_person(self, person):
        """Click the name of a person, if there are several; returns the number of clicks."""
        if len(self.people) == 1:
            return 0
        await self.stranger.click(f"#people label[title='Select {list(self.people)[person]}']")
        await self.stranger.until(f"quadrille.state.state.person === {person}")
        return 1

    async def work(self, key, kind):
        """Press a key that fits or searches, and wait for the result."""
        number = ((await state_of(self.page))["state"]["compared"] or {}).get("number", -1)
        await self.stranger.press(key)
        compared = "quadrille.state.state.compared"
        await self.stranger.until(f"{compared}?.work === '{kind}' && {compared}.number !== {number} && {DONE}", 240)

    async def take_back(self):
        """Undo the last edit, and wait until the views show it: the text comes first, and a joint may still move."""
        undone = (await state_of(self.page))["state"]["undo"]
        await self.page.evaluate("window.overlayBefore = quadrille.state.overlay")
        await self.stranger.press("Control+z")
        is_drawn = "quadrille.state.overlay !== window.overlayBefore"
        await self.stranger.until(f"quadrille.state.state.redo === {json.dumps(undone)} && {is_drawn} && {DONE}")

    async def mark(self, first, last):
        """Mark a range on the timeline."""
        start, end = [await frame_place(self.page, frame, 1 / 3, is_whole=True) for frame in (first, last)]
        self.stranger.stages[-1].mouse += 1
        await self.page.keyboard.down("Shift")
        await drag_mouse(self.page, start, end, steps=4)
        await self.page.keyboard.up("Shift")
        await self.stranger.until(f"quadrille.state.range?.first === {first} && quadrille.state.range.last === {last}")

    async def track_within(self, button, first, last):
        """Track a marked range by its bar, and unmark it."""
        if first < last:
            await self.mark(first, last)
            await self.stranger.click(button)
            await self.stranger.until("quadrille.state.state.range.running || quadrille.state.state.track.running", 60)
            await self.stranger.until(DONE, WORK_S)
            await self.stranger.click("#range-close")

    async def correct_frame(self, frame, person, most=CORRECTED):
        """Drag what looks off, the worst first, in the two views that show it best; returns how much was corrected.

        A drag after which more looks off is taken back.
        """
        stranger, user = self.stranger, self.user(frame, person)
        await stranger.zoom_to_people()
        corrected = int(await stranger.tilt(user, person))
        done = set()
        for _ in range(most):
            seen = await stranger.seen_off(user, self.views, person)
            trunk = [np.mean([seen[n, c][0] for n in TRUNK if (n, c) in seen]) for c in self.views]
            left = {key: off for key, (off, _) in seen.items() if key[0] not in done}
            if "torso" not in done and max(trunk) > OFF_PX:
                joint, order = "torso", np.argsort(trunk)[::-1]
            elif max(left.values()) < OFF_PX:
                break
            else:
                joint, _ = max(left, key=left.__getitem__)
                order = sorted((c for c in self.views if (joint, c) in left), key=lambda c: -left[joint, c])
            done.add(joint)
            n_dragged = await self._drag_in_two(user, joint, [int(c) for c in order], seen, person)
            now = await stranger.seen_off(user, self.views, person)
            if sum(off for off, _ in now.values()) > sum(off for off, _ in seen.values()):
                for _ in range(n_dragged):
                    await self.take_back()
            elif n_dragged:
                corrected += 1
        return corrected

    async def _drag_in_two(self, user, joint, order, seen, person):
        """Drag a joint in the first two views of an order that show it; returns the number of drags."""
        n_dragged = 0
        for camera in order:
            if joint == "torso":
                n_dragged += await self.stranger.move_trunk(user, camera, person)
            else:
                n_dragged += await self.stranger.drag(camera, joint, seen[joint, camera][1], person)
            if n_dragged == 2:
                break
        return n_dragged


def known_lengths(hour, person):
    """The lengths of a person's limbs by name, metres, as a tape measures them."""
    truth = read_joints(hour.truths[person], hour.session.fps)
    at = {n: truth.points[:, i] for i, n in enumerate(truth.names)}
    return {
        part: float(np.mean([
            np.nanmedian(np.linalg.norm(at[f"{side}_{a}"] - at[f"{side}_{b}"], axis=1)) for side in ("left", "right")
        ]))
        for part, (a, b) in LIMB_ENDS.items()
    }  # fmt: skip
