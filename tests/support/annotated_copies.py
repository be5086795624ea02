"""Copies of one store, random edits of them, and what a store shows."""

import shutil

import numpy as np

from tracker.annotation.merge_sessions import merge_logs
from tracker.annotation.numbered_settings import renumbered
from tracker.annotation.plan import add_comment, add_tasks, decide, read_tasks
from tracker.errors import TrackerError
from tracker.formats.model_toml import format_model, load_model
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import AssessmentChange, MarkChange, PinChange, PoseChange, PoseRecord

FRAMES, ACTIONS = range(3), 8


def act(store, action, frame, x):
    """Do one of `ACTIONS` things to a store, the number `x` in it."""
    if action in (0, 1):
        store.commit(f"Drag {x}", [PoseChange("ann", frame, pose(x, keyframe=bool(action)))])
    elif action == 2:
        store.undo()
    elif action == 3:
        store.redo()
    elif action == 4:
        store.commit("Pin", [PinChange("ann", frame, "left_wrist", "cam", (x, x) if x % 3 else None)])
    elif action == 5:
        store.commit("Mark", [MarkChange("ann", frame, keyframe=bool(x % 2), reviewed=True)])
    elif action == 6 and (found := store.pose("ann", frame)) is not None:
        store.commit("Audit", [AssessmentChange("ann", frame, found.values, "good", f"{x}", (), None)], by_program=True)
    elif action == 7:
        try:
            decide(store, ("ann", frame), ("verified", "rejected")[x % 2], f"{x}")
        except TrackerError:  # no pose to verify
            add_comment(store, ("ann", frame), f"{x}")


def pose(x, **more):
    """Return a pose whose root is at x, decimetres."""
    values = np.zeros(len(BODY.value_names))
    values[0] = x / 10
    return PoseRecord(values, ("manual",) * len(values), 1, **more)


BODY = load_model("gavrila22", 1.7)


def new_store(path):
    """Make a store with a body, a plan and a pose on the first frame."""
    store = AnnotationStore(path)
    store.add_model_revision("ann", format_model(BODY))
    add_tasks(store, [("ann", k, "") for k in FRAMES], "lead")
    store.commit("first", [PoseChange("ann", 0, pose(100))])
    return store


def copied(path, to, author=None):
    """Copy a store that is closed, and open the copy as an author."""
    shutil.copyfile(path, to)
    return AnnotationStore(to, author=author)


def merged(one, other, to, tolerance_m=0.025):
    """Merge two closed stores into a new one; returns its path."""
    logs = []
    for path in (one, other):
        with AnnotationStore(path, read_only=True) as store:
            logs.append(store.read_log())
    found = merge_logs(*logs, tolerance_m)
    with AnnotationStore(to) as store:
        written = store.write_log(found.log)
        for key, value in renumbered(found.numbered, [e.uid for e in found.log.edits], found.log.done, written).items():
            store.set_setting(key, value)
    return to


def shown(path):
    """Return all that a store shows of its people, but the history."""
    with AnnotationStore(path, read_only=True) as store:
        bodies = {r.id: r.toml for r in store.model_revisions("ann")}
        poses = {
            k: (
                p.values.tobytes(), bodies[p.model_revision], p.keyframe, p.reviewed, p.status, p.remark, p.author,
                p.time, [a.values.tobytes() for a in store.alternatives("ann", k)],
            )
            for k, p in store.poses("ann", range(100)).items()
        }  # fmt: skip
        pins = {k: store.pins("ann", k) for k in FRAMES}
        return poses, pins, read_tasks(store), store.tasks.comments()


def all_edits(path):
    """Return the identities of all edits of a store, and those that are done, in order."""
    with AnnotationStore(path, read_only=True) as store:
        log = store.read_log()
        return [edit.uid for edit in log.edits], log.done
