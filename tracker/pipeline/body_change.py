"""Move a person to another body: sizes that both bodies have are kept, and keyframes fitted to it, as one edit."""

from typing import NamedTuple

import numpy as np

from tracker.body.dimensions import with_sizes_of
from tracker.body.model import BodyModel, PosedBody
from tracker.errors import TrackerError
from tracker.formats.model_toml import load_model
from tracker.pipeline.automatic_run import FOLLOWED
from tracker.pipeline.body_acquisition import store_body
from tracker.session.session import Session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.stored_poses import read_stored_poses


class ChangedBody(NamedTuple):
    """The result of a move to another body."""

    session: Session
    body: BodyModel
    """The new body."""
    n_refitted: int
    """Number of keyframes, and of found or placed poses, that were fitted to it."""
    off_m: float
    """Mean distance of the joints of these poses before and after, of those that both bodies have, metres."""
    n_kept: int
    """Number of other poses, which keep the body that they were made with."""


def change_body(session: Session, store: AnnotationStore, person: int, name: str) -> ChangedBody:
    """Move a person to another body, such as one with feet.

    Keyframes are fitted to their joints in space, and so are poses that a run goes out from. The others keep the body
    that they were made with until they are tracked again.

    Args:
        session: the session, which this process has locked.
        store: its annotations.
        person: index of the person.
        name: of a preset, or path of a body model.

    Raises:
        TrackerError: there is no such body, the person has it, or the session cannot be written.
    """
    who, body = session.people[person], converted_body(session, person, name)
    stored = read_stored_poses(session.annotations_path, who.name, who.model)
    moved = {k: s for k, s in stored.items() if s.record.keyframe or s.source not in FOLLOWED}
    changed = store_body(session, store, person, body, {}, f"body of {who.name}: {body.name}", moved)
    after = read_stored_poses(session.annotations_path, who.name, body)
    off_m = [joints_off_m(before.body, after[k].body) for k, before in moved.items()]
    return ChangedBody(changed, body, len(moved), float(np.mean(off_m or [0.0])), len(stored) - len(moved))


def converted_body(session: Session, person: int, name: str) -> BodyModel:
    """Return another body in the sizes of a person, as far as their parts correspond.

    Args:
        session: the session.
        person: index of the person.
        name: of a preset, or path of a body model.

    Raises:
        TrackerError: there is no such body, or the person has it.
    """
    who, preset = session.people[person], load_model(name)
    if preset.name == who.model.name:
        raise TrackerError(f"expected another body of {who.name}, found {preset.name} again; name another one")
    return with_sizes_of(preset, who.model)


def joints_off_m(before: PosedBody, after: PosedBody) -> float:
    """Return the mean distance of the joints that two bodies have, metres."""
    one, other = before.named_points_world, after.named_points_world
    return float(np.mean([np.linalg.norm(one[name] - other[name]) for name in one.keys() & other.keys()]))
