"""What a tracker remembers of one person from frame to frame: where they were, their colours, what was searched."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tracker import confidence
from tracker.appearance import Colors, PartColors
from tracker.body import BodyModel
from tracker.confidence import Limb, Status
from tracker.fit import held
from tracker.predict import PredictSettings, predict
from tracker.rigid import Array

_LONGEST_PAUSE = 8
"""A limb that seems lost and is not found is searched at least every so many frames."""
_LEARN_FRAMES, _TRACKED_SHARE, _GIVEN_SHARE = 3, 0.15, 0.5
"""Every so many frames the colours of the parts are brought up to date, and what such a frame counts; what a keyframe
counts against the frames before it."""
_POSES = 8
"""Past poses that are remembered."""


class Memory:
    """What is remembered of one person."""

    def __init__(self, model: BodyModel, start: Array | Sequence[Array], free: NDArray[np.bool_] | None = None) -> None:
        """Begin with the poses before the first frame.

        Args:
            model: the body.
            start: the pose from which the first frame is predicted, (n_values,), or several, the last one last.
            free: the degrees of freedom that may move, (n_dofs,); None: all.
        """
        self.model, self.free = model, free
        moving = np.ones(model.n_dofs, dtype=bool) if free is None else free
        limbs = [limb._replace(dofs=limb.dofs & moving) for limb in confidence.limbs(model)]
        self.limbs = [limb for limb in limbs if limb.dofs.any()]
        """Limbs that may be searched, by what of them may move."""
        self.past = list(np.atleast_2d(np.array(start)))
        """Their last poses, the last one last, (n_values,) each."""
        self.last_good = self.past[-1]
        """The last pose that nothing spoke against, (n_values,)."""
        self.known: PartColors | None = None
        """The colours of their parts; None before the first frame."""
        self._frames = 0
        self._pauses: dict[str, tuple[int, int]] = {}  # per limb: when it may be searched again, and the last pause

    def expected(self, settings: PredictSettings) -> Array:
        """The predicted pose of the next frame."""
        return held(self.model, predict(self.model, self.past, settings), self.past[-1], self.free)

    def may_search(self, limb: Limb) -> bool:
        """Whether a limb is due: one that was searched in vain waits longer each time."""
        return self._frames >= self._pauses.get(limb.name, (0, 0))[0]

    def searched(self, limb: Limb, found: bool) -> None:
        """Note how the search for a limb went."""
        pause = 0 if found else min(_LONGEST_PAUSE, 2 * self._pauses.get(limb.name, (0, 0))[1] + 1)
        self._pauses[limb.name] = (self._frames + pause + 1, pause)

    def update(self, pose: Array, colors: Colors, status: Status, given: bool) -> None:
        """Take in what a frame brought.

        Args:
            pose: where they are, (n_values,).
            colors: of the frame, everybody where they are.
            status: how sure that is.
            given: whether a person said so.
        """
        self._frames += 1
        if self.known is None or given:
            self.known = colors.learn(self.known, _GIVEN_SHARE)
        elif self._frames % _LEARN_FRAMES == 0 and status != "lost":
            self.known = colors.learn(self.known, _TRACKED_SHARE)
        self.past = [*self.past[1 - _POSES :], pose]
        if status == "good":
            self.last_good = pose
