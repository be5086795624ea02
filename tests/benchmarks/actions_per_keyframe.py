"""How many actions a keyframe costs where the tracker does the rest: `python tests/benchmarks/actions_per_keyframe.py`.

A scripted user (tests/support/scripted_user.py) annotates `walk`: places the body on frame 0 from 40 cm and 30 degrees
away, fits, tracks to the next keyframe, looks at it in two views, drags what is off by more than the eye forgives,
fits, verifies it, tracks on. An action is one press to release, or one key. `--data DIR` says where `walk` is.
"""

import argparse
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "support")]

from scripted_user import LIMBS, ScriptedUser

from app.control.controller import Controller
from app.session.frame_cache import FrameCache
from app.storage.saver import Saver
from tracker.evidence.observer import Observer
from tracker.footage.recording import Recording
from tracker.session.assemble import NewSession, assemble
from tracker.session.store.annotation_store import AnnotationStore

VIEWS = (0, 1)
EVERY = 10
"""Frames from one keyframe to the next."""
EYE_PX = 15.0
"""What is this near to where the user takes it to be is left alone. The user aims 3 px off in each direction, and with
two dozen looks at every keyframe 10 px are seen by chance."""
PLACING = ["torso", "left_shoulder", "right_shoulder", "torso"]
"""What is dragged first where the whole body is wrong; shoulders in the second view only, where they show a turn."""


class Annotator:
    """The user at work on a controller, each action counted."""

    def __init__(self, controller: Controller, user: ScriptedUser) -> None:
        self.controller, self.user, self.actions = controller, user, 0

    @property
    def values(self) -> np.ndarray:
        return self.controller.state.poses[0]

    def px(self, point: str, camera: int) -> np.ndarray:
        model = self.controller.models[0]
        place = model.points_world(self.values)[model.point_names.index(point)]
        return self.controller.session.cameras[camera].camera.pinhole.project(place)

    def drag(self, point: str, camera: int, by: np.ndarray) -> None:
        start, hand = self.px(point, camera), self.controller.dragging
        hand.begin_drag(1, camera, 0, point, tuple(start))
        for k in range(1, 9):
            hand.move_drag(1, tuple(start + k / 8 * by), k)
        hand.end_drag(1)
        self.actions += 1

    def key(self, act) -> None:
        act()
        self.actions += 1

    def place(self) -> None:
        """Put a body that is wrong as a whole where it belongs, limb by limb."""
        for point in PLACING:
            for camera in VIEWS if point == "torso" else VIEWS[1:]:
                by = self.user.trunk_off_px(self.values, camera) if point == "torso" else self.off(point, camera)
                self.drag(point, camera, by)
        for joint in ("knee", "ankle", "elbow", "wrist"):
            for side in ("left", "right"):
                for camera in VIEWS:
                    self.drag(f"{side}_{joint}", camera, self.off(f"{side}_{joint}", camera))

    def off(self, point: str, camera: int) -> np.ndarray:
        return self.user.aim_px(point, camera) - self.px(point, camera)

    def mend(self) -> bool:
        """Drag what is off by more than the eye forgives, the worst first; says whether anything was."""
        mended: set[tuple[str, int]] = set()
        while True:
            seen = {(p, c): self.off(p, c) for p in LIMBS for c in VIEWS if (p, c) not in mended}
            (point, camera), by = max(seen.items(), key=lambda item: float(np.hypot(*item[1])))
            if np.hypot(*by) < EYE_PX:
                return len(mended) > 0
            self.drag(point, camera, by)
            mended.add((point, camera))


def wait(controller: Controller, is_done) -> None:
    end = time.monotonic() + 300
    while not is_done(controller.state):
        assert time.monotonic() < end, "the program did not come to an end"
        time.sleep(0.02)


def annotate(controller: Controller, truth: Path) -> None:
    """Work through the recording, and print a line for each keyframe."""
    session, counts = controller.session, []
    for frame in range(0, session.n_frames, EVERY):
        user = ScriptedUser(session, truth, frame, seed=frame, views=VIEWS)
        at = Annotator(controller, user)
        if frame == 0:
            for dof, value in enumerate(user.away()[session.people[0].model.dof_value]):
                controller.pose_edits.set_dof(0, dof, float(value))
            at.place()
        found = user.error_mm(at.values)
        if at.mend() or frame == 0:
            at.key(lambda here=frame: controller.pinning.fit(here))
        if controller.state.people[0].source != "manual":
            at.key(controller.ranges.toggle_keyframe)
        left = user.error_mm(at.values)
        counts.append(at.actions)
        print(f"frame {frame:3}: {found:4.0f} mm found, {at.actions:2} actions, {left:4.0f} mm left", flush=True)
        if frame + EVERY < session.n_frames:
            controller.tracking.start(False, frame + EVERY)
            wait(controller, lambda state: not state.track.running)
            controller.navigation.seek(frame + EVERY)
            wait(controller, lambda state: state.cost_px is not None)
    print(f"first keyframe {counts[0]} actions; the {len(counts) - 1} others: median {np.median(counts[1:]):g}")


def main() -> None:
    """Annotate and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="the folder with `walk`")
    walk = parser.parse_args().data / "walk"
    with tempfile.TemporaryDirectory() as name:
        session = assemble(NewSession(
            Path(name) / "session", calibration=walk / "Calib.toml", videos=sorted(walk.glob("*.mp4")),
            background=walk / "background", heights=1.75,
        ))  # fmt: skip
        with (
            closing(Recording(session.cameras)) as recording,
            closing(AnnotationStore(session.annotations_path)) as store,
        ):
            controller = Controller(session, Saver(session, store), FrameCache(Observer(session.cameras, recording)))
            try:
                wait(controller, lambda state: state.cost_px is not None)
                annotate(controller, walk / "ground_truth.trc")
            finally:
                controller.close()


if __name__ == "__main__":
    main()
