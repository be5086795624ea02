"""What a tracker remembers of one person from frame to frame: where they were, their colours, what was searched."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tracker.appearance.part_colors import Colors, PartColors
from tracker.body.limbs import Limb
from tracker.body.model import BodyModel
from tracker.fitting.gauss_newton import with_locked_dofs
from tracker.geometry.arrays import Array
from tracker.motion.prediction import PredictSettings, predict
from tracker.tracking import confidence
from tracker.tracking.confidence import Quality, Status

_LONGEST_PAUSE = 8
"""A limb that seems lost and is not found is searched at least every so many frames."""
_UNDOUBTED_PAUSE, _LONGEST_UNDOUBTED = 31, 64
"""One of several people that nothing speaks against but what no part explains, which may be anybody's, waits so many
frames after the first search in vain, and so many at most."""
_LEARN_FRAMES, _TRACKED_SHARE, _GIVEN_SHARE = 3, 0.15, 0.5
"""Every so many frames the colours of the parts are brought up to date, and what such a frame counts; what a keyframe
counts against the frames before it."""
_POSES = 8
"""Past poses that are remembered."""


class Memory:
    """What is remembered of one person."""

    def __init__(
        self,
        model: BodyModel,
        start: Array | Sequence[Array],
        free: NDArray[np.bool_] | None = None,
        alone: bool = True,
    ) -> None:
        """Begin with the poses before the first frame.

        Args:
            model: the body.
            start: the pose from which the first frame is predicted, (n_values,), or several, the last one last.
            free: the degrees of freedom that may move, (n_dofs,); None: all.
            alone: whether there is nobody else.
        """
        self.model, self.free, self.alone = model, free, alone
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
        self._pauses: dict[str, tuple[int, int]] = {}  # per limb: when it was searched, and the pause after that

    def expected(self, settings: PredictSettings) -> Array:
        """The predicted pose of the next frame."""
        return self._expected(settings, self.past)

    def expected_ahead(self, settings: PredictSettings) -> Array:
        """The predicted pose of the frame after the next one, (n_values,), as if that came as expected."""
        return self._expected(settings, [*self.past, self.expected(settings)])

    def was_expected(self, settings: PredictSettings) -> Array:
        """The pose of the next frame, (n_values,), as it was predicted before the last one was known."""
        return self._expected(settings, [*self.past[:-1], self._expected(settings, self.past[:-1])])

    def _expected(self, settings: PredictSettings, past: list[Array]) -> Array:
        return with_locked_dofs(self.model, predict(self.model, past, settings), past[-1], self.free)

    def suspects(self, found: Quality) -> list[Limb]:
        """Limbs worth a search that may move, likeliest to be lost first."""
        return [x for name in found.suspects(self.alone) for x in self.limbs if x.name == name]

    def due(self, found: Quality) -> list[Limb]:
        """Those of them whose turn it is: one that was searched in vain waits longer each time.

        Of somebody alone a limb that is likelier lost than found does not wait: a limb that moves fast is elsewhere in
        each frame, and the longer it goes astray the farther off is all that is predicted from it.

        Of several people nobody knows whose it is what no part explains: it makes nobody's limb due while another of
        theirs seems lost itself, and those that it does wait longer.

        Args:
            found: what the evidence says of the pose.
        """
        suspects, alone = self.suspects(found), self.alone
        doubted = [] if alone else [x for x in suspects if x.name in found.doubted(alone)]
        longest = _LONGEST_PAUSE if alone or doubted else _LONGEST_UNDOUBTED

        def rested(limb: Limb) -> bool:
            last, pause = self._pauses.get(limb.name, (-1, 0))
            return (alone and limb.name in found.lost) or self._frames > last + min(pause, longest)

        return [x for x in doubted or suspects if rested(x)]

    def searched(self, limb: Limb, before: Quality, found: bool) -> None:
        """Note how the search for a limb went, and what the evidence had said before."""
        least = 1 if self.alone or limb.name in before.doubted(self.alone) else _UNDOUBTED_PAUSE
        longer = max(least, 2 * self._pauses.get(limb.name, (0, 0))[1] + 1)
        self._pauses[limb.name] = (self._frames, 0 if found else min(_LONGEST_UNDOUBTED, longer))

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
