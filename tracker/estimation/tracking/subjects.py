"""The people of a tracking run: their bodies, whom to track, what may move, and keyframes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.errors import Remedy, TrackerError
from tracker.formats.model_toml import load_model
from tracker.geometry.arrays import Array

Keyframes = Mapping[int, Mapping[int, Array]]
"""Poses that a tracker takes as they are, (n_values,), by frame and index of the person."""


@dataclass(frozen=True, eq=False)
class Subjects:
    """The people of a tracking run. All sequences are indexed by person."""

    models: tuple[BodyModel, ...]
    """The body of each person."""
    tracked: tuple[int, ...]
    """Indices of the people to track. The others keep their start pose or their keyframes."""
    active_dofs: tuple[NDArray[np.bool_] | None, ...]
    """The degrees of freedom of each person that may move, (n_dofs,); None: all. The others keep their start value or
    that of the last keyframe."""
    keyframes: Keyframes
    """Poses that stay as they are; tracking goes on from them."""

    @classmethod
    def of(
        cls,
        models: Sequence[BodyModel],
        tracked: Sequence[int] | None = None,
        active_dofs: Sequence[NDArray[np.bool_] | None] | None = None,
        keyframes: Keyframes | None = None,
    ) -> "Subjects":
        """Return the subjects; by default everybody is tracked, everything may move, and no pose is known."""
        return cls(
            tuple(models),
            tuple(range(len(models))) if tracked is None else tuple(tracked),
            (None,) * len(models) if active_dofs is None else tuple(active_dofs),
            {} if keyframes is None else keyframes,
        )

    def keyframes_at(self, frame: int) -> Mapping[int, Array]:
        """Return the keyframes of a frame by person."""
        return self.keyframes.get(frame, {})


def require_body(preset: str, shape: type, bodies: Mapping[str, BodyModel]) -> None:
    """Check that people have the body of a paper, of any sizes.

    Args:
        preset: name of the body.
        shape: kind of the shapes of its parts.
        bodies: by name of the person.

    Raises:
        TrackerError: a person has another body.
    """
    dofs = load_model(preset).dof_names
    for name, body in bodies.items():
        if body.dof_names != dofs or not all(isinstance(s, shape) for s in body.shapes):
            raise TrackerError(
                f"expected the paper's body {preset} of '{name}', found {body.name} of {body.n_dofs} degrees of "
                "freedom",
                Remedy("paper_body", body=preset),
            )
