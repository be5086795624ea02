"""Locked degrees of freedom, which neither a hand nor a search nor a fit moves: how they are kept with a session."""

from collections.abc import Callable, Collection, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.session.session import Person

SETTING = "locked"
"""Setting of the session: by name of the person the names of the degrees of freedom."""


def kept_locks(people: Sequence[Person], setting: Callable[[str, Any], Any]) -> tuple[frozenset[int], ...]:
    """What is locked of each person, by index; names that a model has no more are passed over.

    Args:
        people: of the session.
        setting: what is kept with the session under a name, or a default.
    """
    kept = setting(SETTING, {})
    return tuple(
        frozenset(i for i, name in enumerate(p.model.dof_names) if name in kept.get(p.name, ())) for p in people
    )


def to_keep(people: Sequence[Person], locks: Sequence[Collection[int]]) -> dict[str, list[str]]:
    """The value of `SETTING` for what is locked of each person, by index."""
    return {p.name: [p.model.dof_names[i] for i in sorted(dofs)] for p, dofs in zip(people, locks, strict=True)}


def free_of(model: BodyModel, locked: Collection[int]) -> NDArray[np.bool_]:
    """The degrees of freedom of a body that may move, (n_dofs,)."""
    return ~np.isin(np.arange(model.n_dofs), list(locked))
