"""Measure the height of a person on the frames around a start: who bends or dances on one stands upright on others."""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from typing import NamedTuple

import numpy as np

from tracker.body.motion.path_identities import SAME_PERSON_M
from tracker.errors import TrackerError
from tracker.estimation.initialization.generators.person_scene import PersonScene
from tracker.estimation.initialization.generators.stature import upright_height
from tracker.geometry.arrays import Array

_STEP = 6
"""Distance of the frames on which heights are measured."""
_N_HEIGHTS, _MAX_FRAMES = 3, 8
"""Number of heights of which the median is taken, and of frames on which they are looked for."""


class _Measured(NamedTuple):
    center: Array
    """Of the figure, (3,), metres."""
    height_m: float | None
    """None if the person does not stand upright."""


class StandingHeights:
    """Heights of the figures on some frames of a recording. Each frame is measured once."""

    def __init__(self, scenes: Callable[[int, int], Sequence[PersonScene]], n_frames: int, n_people: int) -> None:
        """Prepare the measurement.

        Args:
            scenes: returns one for each figure on a frame, by frame and by index of the person whose masks are used.
            n_frames: of the recording.
            n_people: in it.
        """
        self._scenes, self._n_frames, self._n_people = scenes, n_frames, n_people
        self._measured: dict[tuple[int, int], list[_Measured]] = {}

    def around(self, scene: PersonScene, frame: int, person: int) -> float | None:
        """Return the median of the heights of a person on a frame and on those around it, metres; None without any.

        Args:
            scene: the person on the frame.
            frame: its number.
            person: index of the person.
        """
        center = scene.figure.points_world.mean(axis=0)
        after = range(frame - frame % _STEP + _STEP, self._n_frames, _STEP)
        before = range(frame - 1 - (frame - 1) % _STEP, -1, -_STEP)
        measured = _in_turn([self._along(center, frames, person) for frames in (after, before)])
        heights = [h for h in (upright_height(scene),) if h is not None]
        elsewhere = (h for h in islice(measured, _MAX_FRAMES) if h is not None)
        heights += islice(elsewhere, _N_HEIGHTS - len(heights))
        return float(np.median(heights)) if heights else None

    def _along(self, center: Array, frames: Sequence[int], person: int) -> Iterator[float | None]:
        """Yield the height of a figure on some frames, or None, up to the first on which its identity is ambiguous."""
        for frame in frames:
            found = self._on_frame(frame, person)
            away = [float(np.linalg.norm(m.center - center)) for m in found]
            if len(found) < self._n_people or min(away) > SAME_PERSON_M:
                return
            center, height_m = found[int(np.argmin(away))]
            yield height_m

    def _on_frame(self, frame: int, person: int) -> list[_Measured]:
        if (frame, person) not in self._measured:
            try:
                scenes = self._scenes(frame, person)
            except TrackerError:
                scenes = ()
            self._measured[frame, person] = [
                _Measured(s.figure.points_world.mean(axis=0), upright_height(s)) for s in scenes
            ]
        return self._measured[frame, person]


def _in_turn(ways: Sequence[Iterator[float | None]]) -> Iterator[float | None]:
    """Yield one item of each iterator in turn, until all have ended."""
    waiting = deque(ways)
    while waiting:
        way = waiting.popleft()
        for item in way:
            yield item
            waiting.append(way)
            break
