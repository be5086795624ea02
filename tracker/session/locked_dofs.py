"""Locked degrees of freedom, which no edit, search or fit changes: how they are stored with a session."""

from collections.abc import Callable, Collection, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tracker.body.limbs import display_name
from tracker.body.model import BodyModel
from tracker.errors import SessionError, TrackerError
from tracker.session.session import Person
from tracker.validation import check

SETTING = "locked"
"""Key of the session's setting: by name of the person the names of the locked degrees of freedom."""


def load_locks(people: Sequence[Person], setting: Callable[[str, Any], Any]) -> tuple[frozenset[int], ...]:
    """Load the locked degrees of freedom of each person, by index. Names that a model lacks are ignored.

    Args:
        people: of the session.
        setting: returns the session's setting of a name, or a default.

    Raises:
        SessionError: the setting is not one that `locks_setting` made.
    """
    stored = check(setting(SETTING, {}), dict[str, list[str]], f"setting '{SETTING}' of the session", SessionError)
    return tuple(
        frozenset(i for i, name in enumerate(p.model.dof_names) if name in stored.get(p.name, ())) for p in people
    )


def locks_setting(people: Sequence[Person], locks: Sequence[Collection[int]]) -> dict[str, list[str]]:
    """Return the value of `SETTING` for the locked degrees of freedom of each person; the inverse of `load_locks`."""
    return {p.name: [p.model.dof_names[i] for i in sorted(dofs)] for p, dofs in zip(people, locks, strict=True)}


def active_dofs(model: BodyModel, locked: Collection[int]) -> NDArray[np.bool_]:
    """Return which degrees of freedom of a body are not locked, (n_dofs,)."""
    return ~np.isin(np.arange(model.n_dofs), list(locked))


def require_unlocked(model: BodyModel, locked: Collection[int], dofs: Collection[int]) -> None:
    """Check that no degree of freedom of an edit is locked.

    Raises:
        TrackerError: one is.
    """
    for dof in sorted({*locked} & {*dofs}):
        raise TrackerError(f"{display_name(model.dof_names[dof])} is locked; unlock it to change it")
