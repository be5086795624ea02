"""Measure a seek with many people and cameras: `python tests/benchmarks/many_people.py`.

Prints the processor time of drawing the vectors over all views, and over one view, for one person and for eight in four
and in sixteen views. No footage is read. Then the processor time of opening the annotations of a recording, and of
saving an edit. `--frames 100000` takes a longer recording, whose store is written first, which takes minutes.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "support"), str(ROOT)]

from staging import cameras_around

from app.messages import encoding
from app.state.page_view import View
from app.state.people import ShownPose
from app.state.state import State
from app.storage.saver import Saver
from tracker.formats.model_toml import format_model
from tracker.session.session import Session, load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange, PoseRecord

SAMPLE = ROOT / "sample_sessions" / "elbow_rotation"
LAYERS = frozenset(("image", "contours", "hidden", "joints"))
SIZES = ((1, 4), (1, 16), (8, 4), (8, 16))
"""Numbers of people and of cameras."""
BATCH = 1000
"""Frames of one edit, as tracking writes them."""
N_EDITS = 5
"""Number of edits that are timed."""


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
        people=tuple(shown), models=tuple(p.model for p in people), revisions=(1,) * n_people,
        present=(1,) * n_people, locked=(frozenset(),) * n_people, pins=((),) * n_people,
    )  # fmt: skip
    return replace(session, cameras=cameras, people=people), state


def overlay_s(session: Session, state: State, reductions: tuple[float, ...]) -> float:
    """Processor time of an overlay: the least of five, after one that fills the caches."""
    view, took = View(LAYERS, reductions), []
    for _ in range(6):
        began = time.process_time()
        encoding.overlay(session, state, 1, view, None)
        took.append(time.process_time() - began)
    return min(took[1:])


def write_poses(session: Session, state: State, path: Path, n_frames: int) -> None:
    """Write a tracked pose of each person on each frame."""
    store = AnnotationStore(path)
    poses = []
    for person, values in zip(session.people, state.poses, strict=True):
        revision = store.add_model_revision(person.name, format_model(person.model))
        poses.append(PoseRecord(values, ("tracked",) * len(values), revision, status="good", cost_px=2.0))
    for first in range(0, n_frames, BATCH):
        frames = range(first, min(n_frames, first + BATCH))
        changes = [PoseChange(p.name, k, pose) for k in frames for p, pose in zip(session.people, poses, strict=True)]
        store.commit("track", changes, by_program=True)
    store.close()


def spent_s(work: Callable[[], object]) -> tuple[float, object]:
    """Processor time of some work, and its result."""
    began = time.process_time()
    result = work()
    return time.process_time() - began, result


def long_session(session: Session, state: State, path: Path, n_frames: int) -> str:
    """Measure opening a store of a pose of each person on each frame, and saving edits; returns a line of figures."""
    write_poses(session, state, path, n_frames)
    checked_s, store = spent_s(lambda: AnnotationStore(path))
    listed_s, saver = spent_s(lambda: Saver(session, store))
    sent_s, _ = spent_s(lambda: cells(saver, 0))
    edits_s = [spent_s(lambda: edit(saver, frame))[0] for frame in range(0, n_frames, n_frames // N_EDITS)]  # noqa: B023
    store.close()
    size_mb = path.stat().st_size / 2**20
    return (
        f"{len(session.people)} x {n_frames} frames, {size_mb:.0f} MB: check {checked_s:.1f} s, list {listed_s:.1f} s, "
        f"cells for the page {sent_s:.1f} s, an edit {1e3 * float(np.median(edits_s)):.0f} ms"
    )


def edit(saver: Saver, frame: int) -> None:
    """Save an edit of the first person as the page does, and make the cells that it changes."""
    version, record = saver.index.version, saver.record(0, frame)
    change = PoseChange(saver._session.people[0].name, frame, replace(record, keyframe=True))
    saver.write("drag", [change], None, by_program=False)
    cells(saver, version)


def cells(saver: Saver, since: int) -> list[object]:
    """Make the messages of cells that a page receives: of all people, and of each of several."""
    n_people = len(saver._session.people)
    several = range(n_people) if n_people > 1 else ()
    return [encoding.timeline(saver.index.timeline(since, p), since == 0, p) for p in (None, *several)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=2000, help="length of the recording that is opened")
    n_frames = parser.parse_args().frames
    for n_people, n_cameras in SIZES:
        session, state = crowd(n_people, n_cameras)
        full = overlay_s(session, state, (2.0,) * n_cameras)
        one = overlay_s(session, state, (2.0,) + (0.0,) * (n_cameras - 1))
        print(f"{n_people} x {n_cameras}: vectors of all views {1e3 * full:.0f} ms, of one {1e3 * one:.0f} ms")
    for n_people in (1, 8):
        with tempfile.TemporaryDirectory() as folder:
            print(long_session(*crowd(n_people, 4), Path(folder) / "annotations.sqlite", n_frames), flush=True)


if __name__ == "__main__":
    main()
