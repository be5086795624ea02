"""What a seek costs with many people and cameras: `python tests/benchmarks/many_people.py`.

Prints the processor time of drawing the vectors over all views, and over one view, for one person and for eight in four
and in sixteen views. No footage is read. Then the processor time of listing the frames of a recording when it opens.
"""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "support"), str(ROOT)]

from staging import cameras_around

from app.page import messages
from app.state.page_view import View
from app.state.people import ShownPose
from app.state.state import State
from app.storage.timeline_cells import TimelineCells
from tracker.session.session import Session, load_session
from tracker.store.records import FrameRow

SAMPLE = ROOT / "sample_sessions" / "elbow_rotation"
LAYERS = frozenset(("image", "contours", "hidden", "joints"))
SIZES = ((1, 4), (1, 16), (8, 4), (8, 16))
"""Numbers of people and of cameras."""
N_FRAMES = 10_000


def crowd(n_people: int, n_cameras: int) -> tuple[Session, State]:
    """Place people around the middle of a ring of cameras, near enough to occlude one another."""
    session, rng = load_session(SAMPLE), np.random.default_rng(0)
    source, person = session.cameras[0], session.people[0]
    cameras = tuple(replace(source, camera=camera) for camera in cameras_around(n_cameras, radius_m=6.0))
    people = tuple(replace(person, name=f"person {i}") for i in range(n_people))
    shown = []
    for _ in people:
        values = person.model.neutral()
        values[:2] += rng.normal(0.0, 0.7, 2)
        values[6:] += rng.normal(0.0, 0.2, len(values) - 6)
        shown.append(ShownPose(values, "tracked"))
    state = State(
        0, tuple(shown), tuple(p.model for p in people), (1,) * n_people, (1,) * n_people,
        locked=(frozenset(),) * n_people, pins=((),) * n_people,
    )  # fmt: skip
    return replace(session, cameras=cameras, people=people), state


def overlay_s(session: Session, state: State, reductions: tuple[float, ...]) -> float:
    """Processor time of an overlay: the least of five, after one that fills the caches."""
    view, took = View(LAYERS, reductions), []
    for _ in range(6):
        began = time.process_time()
        messages.overlay(session, state, 1, view, None)
        took.append(time.process_time() - began)
    return min(took[1:])


def listing_s(n_people: int) -> float:
    """Processor time of the cells of all frames."""
    names = [f"person {i}" for i in range(n_people)]
    row = FrameRow(0, "tracked", "good", 2.0, False)
    rows = {frame: dict.fromkeys(names, row) for frame in range(N_FRAMES)}
    cells, began = TimelineCells(names), time.process_time()
    cells.begin(rows)
    return time.process_time() - began


def main() -> None:
    for n_people, n_cameras in SIZES:
        session, state = crowd(n_people, n_cameras)
        full = overlay_s(session, state, (2.0,) * n_cameras)
        one = overlay_s(session, state, (2.0,) + (0.0,) * (n_cameras - 1))
        print(f"{n_people} x {n_cameras}: vectors of all views {1e3 * full:.0f} ms, of one {1e3 * one:.0f} ms")
    for n_people in (1, 8):
        print(f"{n_people} x {N_FRAMES} frames: their cells {1e3 * listing_s(n_people):.0f} ms")


if __name__ == "__main__":
    main()
