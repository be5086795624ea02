"""The state that a tracker carries from frame to frame for one person: poses, colours, and the back-off of searches."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tracker.body.limbs import Limb, limbs, movable
from tracker.body.model import BodyModel
from tracker.body.motion.history import HISTORY_FRAMES
from tracker.body.motion.pose_steps import PredictSettings, predict
from tracker.estimation.appearance.part_colors import Colors, PartColors
from tracker.estimation.fitting.gauss_newton import with_locked_dofs
from tracker.estimation.tracking.confidence import PoseQuality, Status
from tracker.geometry.arrays import Array

_WORSE_NATS = 2.0
"""The back-off of a limb ends where its odds are higher by this than before the search that failed, nats. That
search has not seen what now contradicts the limb."""
_LEARN_FRAMES = 3
"""The colours of the parts are updated every so many frames."""
_TRACKED_SHARE, _KEYFRAME_SHARE = 0.15, 0.5
"""Weight of a tracked frame, and of a keyframe, against the colours learnt before."""


class PersonMemory:
    """The state of one person."""

    def __init__(
        self,
        model: BodyModel,
        start: Array | Sequence[Array],
        active_dofs: NDArray[np.bool_] | None = None,
        alone: bool = True,
    ) -> None:
        """Begin with the poses before the first frame.

        Args:
            model: the body.
            start: the pose from which the first frame is predicted, (n_values,), or several, the last one last.
            active_dofs: the degrees of freedom that may move, (n_dofs,); None: all.
            alone: whether there is nobody else.
        """
        self.model, self.active_dofs, self.alone = model, active_dofs, alone
        self.limbs = movable(limbs(model), active_dofs)
        """Limbs that may be searched, with their active degrees of freedom."""
        self.history = list(np.atleast_2d(np.array(start)))
        """The last poses, the last one last, (n_values,) each."""
        self.last_good = self.history[-1]
        """The last pose of status "good", (n_values,)."""
        self.part_colors: PartColors | None = None
        """The colours of the parts; None before the first frame."""
        self.step_frames: int | None = None
        """Frames from the last pose to the one that is estimated, negative backward; None where the velocity there is
        unknown, or known otherwise than from the last pose."""
        self._n_frames = 0
        self._backoffs: dict[str, tuple[int, int]] = {}  # by limb: frame of the last search, back-off
        self._odds_searched: dict[str, float] = {}  # by limb: odds before the last search

    def predict(self, settings: PredictSettings) -> Array:
        """Return the predicted pose of the next frame, (n_values,)."""
        return self._predict(settings, self.history)

    def predict_two_ahead(self, settings: PredictSettings) -> Array:
        """Return the predicted pose of the frame after the next, (n_values,), if the next is as predicted."""
        return self._predict(settings, [*self.history, self.predict(settings)])

    def predict_before_last(self, settings: PredictSettings) -> Array:
        """Return the pose of the next frame, (n_values,), as predicted before the last one was known."""
        return self._predict(settings, [*self.history[:-1], self._predict(settings, self.history[:-1])])

    def _predict(self, settings: PredictSettings, history: list[Array]) -> Array:
        return with_locked_dofs(self.model, predict(self.model, history, settings), history[-1], self.active_dofs)

    def search_candidates(self, quality: PoseQuality) -> list[Limb]:
        """Return the limbs worth a search that may move, most likely lost first."""
        return [x for name in quality.limbs_to_search for x in self.limbs if x.name == name]

    def limbs_to_search(self, quality: PoseQuality) -> list[Limb]:
        """Return the limbs to search now. After each failed search a limb's back-off doubles.

        A single person's limb that is more likely off than not does not back off. A fast limb is elsewhere in each
        frame, and predictions from a wrong pose get worse. A limb does not wait either if the frame contradicts it
        much more than that of the last search.

        Args:
            quality: of the refined pose.
        """

        def cooled_down(limb: Limb) -> bool:
            if self.alone and (limb.name in quality.missing_limbs or self._is_worse(limb, quality)):
                return True
            last, backoff = self._backoffs.get(limb.name, (-1, 0))
            return self._n_frames > last + backoff

        return [x for x in self.search_candidates(quality) if cooled_down(x)]

    def record_search(self, limb: Limb, before: PoseQuality, found: bool) -> None:
        """Record the outcome of a limb search.

        Args:
            limb: the limb that was searched.
            before: quality of the pose before the search.
            found: whether the limb moved.
        """
        longer = min(HISTORY_FRAMES, 2 * self._backoffs.get(limb.name, (0, 0))[1] + 1)
        self._backoffs[limb.name] = (self._n_frames, 0 if found else longer)
        self._odds_searched[limb.name] = before.off_odds_of(limb.name)

    def _is_worse(self, limb: Limb, quality: PoseQuality) -> bool:
        """Return whether a limb is much more likely lost than before its last search."""
        return quality.off_odds_of(limb.name) > self._odds_searched.get(limb.name, np.inf) + _WORSE_NATS

    def update(self, pose: Array, colors: Colors, status: Status, keyframe: bool) -> None:
        """Take in the result of a frame.

        Args:
            pose: of the person, (n_values,).
            colors: of the frame, with all people in their poses.
            status: of the pose.
            keyframe: whether the pose is a keyframe.
        """
        self._n_frames += 1
        if self.part_colors is None or keyframe:
            self.part_colors = colors.learn(self.part_colors, _KEYFRAME_SHARE)
        elif self._n_frames % _LEARN_FRAMES == 0 and status != "lost":
            self.part_colors = colors.learn(self.part_colors, _TRACKED_SHARE)
        self.history = [*self.history[1 - HISTORY_FRAMES :], pose]
        if status == "good":
            self.last_good = pose
