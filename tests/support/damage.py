"""Damage to the file of a store, as disks, drives and programs do it; and everything that a store shows."""

import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np

from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import Alternative, MarkChange, PinChange, PoseChange, PoseRecord

N_FRAMES = 120
OLD_STORES = Path(__file__).parents[1] / "tracker" / "session" / "store"
"""Stores of earlier versions as SQL."""


def written_store(path):
    """Write a store with all kinds of content, part of it undone."""
    rng = np.random.default_rng(5)
    with AnnotationStore(path) as store:
        revisions = {name: store.add_model_revision(name, f"name = '{name}'\n" * 40) for name in ("ann", "bo")}

        def pose(name, source, **more):
            values = rng.normal(size=40)
            sources = (source,) * 40
            costs = {"view_costs_px": (1.5, None, 0.25), "part_costs_px": (0.5,) * 17, "limbs_lost": (0.5, 0.125)}
            return PoseRecord(values, sources, revisions[name], cost_px=1.25, **costs, **more)

        for name in revisions:
            store.commit("place", [PoseChange(name, 0, pose(name, "manual", keyframe=True))], "eve")
            poses = [pose(name, "tracked", status="good", settings={"method": "chamfer"}) for _ in range(N_FRAMES)]
            changes = [
                PoseChange(name, f, p, (Alternative(p.values + 1, revisions[name], 2.0),)) for f, p in enumerate(poses)
            ]
            store.commit("track", changes, by_program=True)
        for frame in range(0, N_FRAMES, 7):
            store.commit("drag", [PoseChange("ann", frame, pose("ann", "manual", keyframe=True))])
            store.commit("pin", [PinChange("ann", frame, "left_wrist", "front", (10.5 + frame, 3.25))])
            store.commit("mark", [MarkChange("bo", frame, keyframe=False, reviewed=True)])
        store.set_setting("locked", {"ann": ["left_elbow.extension"]})
        store.commit("clear", [PoseChange("bo", 5, None)])
        store.undo()
        store.undo()


def shown(store):
    """Everything that a store shows, in a form that can be compared, and the same after all its undos."""
    states = []
    for _ in range(4):
        state = {"history": store.history(), "settings": store.setting("locked")}
        for name in ("ann", "bo"):
            state[name, "rows"] = store.frames(name)
            state[name, "revisions"] = store.model_revisions(name)
            for row in state[name, "rows"]:
                record = store.pose(name, row.frame)
                state[name, row.frame] = (
                    record.values.tobytes(), record.sources, record.model_revision, record.keyframe, record.status,
                    record.cost_px, dict(record.settings), record.author, record.time, record.program,
                    record.view_costs_px, record.part_costs_px, record.remark, record.reviewed,
                    record.limbs_lost,
                    [(a.values.tobytes(), a.model_revision, a.cost_px) for a in store.alternatives(name, row.frame)],
                    store.pins(name, row.frame),
                )  # fmt: skip
        states.append(state)
        for _ in range(18):
            store.undo()
    return states


def damaged(data, older, rng):
    """Damage the bytes of a file; `older` is the file as it was before its last edits. Returns bytes and a name."""
    data, page = bytearray(data), 4096
    n_pages = len(data) // page
    kinds = ("flip", "flips", "flips of a header", "truncated", "zero page", "noise", "swapped pages", "stale page",
             "zero tail", "shifted", "zero bytes")  # fmt: skip
    kind = kinds[rng.integers(len(kinds))]
    at = int(rng.integers(len(data)))
    a, b = (int(i) * page for i in rng.integers(n_pages, size=2))
    if kind == "flip":
        data[at] ^= 1 << int(rng.integers(8))
    elif kind == "flips":
        for i in rng.integers(len(data), size=rng.integers(2, 40)):
            data[i] ^= 1 << int(rng.integers(8))
    elif kind == "flips of a header":
        for i in rng.integers(100, size=rng.integers(1, 3)):
            data[i] ^= 1 << int(rng.integers(8))
    elif kind == "truncated":
        del data[at:]
    elif kind == "zero page":
        data[a : a + page] = bytes(page)
    elif kind == "noise":
        data[at : at + 200] = rng.bytes(min(200, len(data) - at))
    elif kind == "swapped pages":
        data[a : a + page], data[b : b + page] = data[b : b + page], data[a : a + page]
    elif kind == "stale page":
        a = min(a, len(older) - page)
        data[a : a + page] = older[a : a + page]
    elif kind == "zero tail":
        data[at:] = bytes(len(data) - at)
    elif kind == "shifted":
        data[at:at] = b"\0"
    elif kind == "zero bytes":
        data[at : at + 16] = bytes(min(16, len(data) - at))
    return bytes(data), kind


def altered(path, *statements, parameters=()):
    """Change a store as a disk does, without the program's checksums."""
    with closing(sqlite3.connect(path)) as db:
        for statement in statements:
            db.execute(statement, parameters)
        db.commit()


def old_store(path, version):
    """Write a store as the program of a version wrote it; return its path."""
    with closing(sqlite3.connect(path)) as db:
        db.executescript((OLD_STORES / f"store_version_{version}.sql").read_text("utf-8"))
    return path
