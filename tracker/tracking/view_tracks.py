"""Track the same frames once more without each view in turn, each time with a history of its own.

A view that holds a limb at a wrong edge no longer does where it is left out, so that the tracks come apart (deletion
of groups of data: J. Tukey 1958, Ann. Math. Stat. 29:614). A pose refitted without a view on a single frame stays in
the same minimum and shows nothing.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.evidence.shared_observers import shared_observers
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Region
from tracker.motion.velocity import velocity
from tracker.tracking.estimate import PoseEstimate
from tracker.tracking.person_memory import HISTORY_FRAMES
from tracker.tracking.tracker import Tracker, TrackingRun
from tracker.tracking.view_regions import regions

_MAX_TRACKS = 6
"""Largest number of tracks; of more views, several are left out together."""


class FrameTracks(NamedTuple):
    """The poses of one person on a frame by several tracks."""

    poses: Array
    """(n_tracks, n_values)."""
    trust: Array
    """Probability that each limb is not lost, by the track's own status, (n_tracks, n_limbs)."""
    without: tuple[str, ...]
    """The views that each track lacks, for people to read, (n_tracks,)."""
    has_history: bool = True
    """Whether the tracks have had the time to come apart: as many frames as a tracker remembers."""


def left_out(n_views: int) -> list[list[int]]:
    """Return the indices of the views of each track: all without one, or without every sixth; none for two views."""
    n_tracks = min(n_views, _MAX_TRACKS) if n_views > 2 else 0  # one view shows no depth
    return [[i for i in range(n_views) if i % n_tracks != track] for track in range(n_tracks)]


def tracks_without_views(
    tracker: Tracker, run: TrackingRun, known: Mapping[int, Sequence[Array]]
) -> Iterator[tuple[int, dict[int, FrameTracks]]]:
    """Track all frames of a run without each view in turn, side by side.

    The tracks have not seen the keyframes that they are compared with, but go on from them. Many of their poses are in
    doubt because a view is missing. Their surroundings are not searched: the repair does that, with all views.

    Args:
        tracker: the method.
        run: the frames in their order, and the poses to begin with.
        known: by frame, the poses of all people that a track with all views found, (n_values,) each. They say where
            evidence is computed.

    Yields:
        Each frame with the tracks of each tracked person.
    """
    groups, cameras, models = left_out(len(run.observer.cameras)), run.observer.working_cameras, run.subjects.models

    def around(views: Sequence[int]) -> Callable[[int], list[Region | None]]:
        """Return the regions of some views by frame."""

        def on(frame: int) -> list[Region | None]:
            bodies = [PosedBody(m, v) for m, v in zip(models, known[frame], strict=True)]
            return regions([cameras[i] for i in views], bodies)

        return on

    names = [c.camera.name for c in run.observer.cameras]
    without = tuple(", ".join(n for i, n in enumerate(names) if i not in views) for views in groups)
    observers = shared_observers(run.observer, groups)
    if any(any(run.observer.ahead_frames(k)) for k in run.frames):
        run = replace(run, velocities=velocities_of(models, known))
    runs = [
        replace(run, observer=o, regions=around(views), estimates_keyframes=True, searches_around=False)
        for o, views in zip(observers, groups, strict=True)
    ]
    ways = [tracker.estimates(own) for own in runs]
    # One after the other: a thread for each track was no faster, since they share the interpreter.
    for n_before, frame in enumerate(run.frames if ways else ()):
        found, has_history = [next(way) for way in ways], n_before >= HISTORY_FRAMES
        yield frame, {person: _of_person(found, person, without, has_history) for person in run.subjects.tracked}


def velocities_of(
    models: Sequence[BodyModel], known: Mapping[int, Sequence[Array]]
) -> Callable[[int], list[Array | None]]:
    """Return a function from a frame to the velocity of each person there, by known poses of all people by frame."""
    by_person = [{k: poses[p] for k, poses in known.items()} for p in range(len(models))]

    def at(frame: int) -> list[Array | None]:
        return [velocity(m, poses, frame) for m, poses in zip(models, by_person, strict=True)]

    return at


def _of_person(found: Sequence[PoseEstimate], person: int, without: tuple[str, ...], has_history: bool) -> FrameTracks:
    qualities = [e.qualities[person] for e in found]
    n_limbs = max((len(q.limbs) for q in qualities if q is not None), default=0)
    trust = np.array([np.ones(n_limbs) if q is None else 1 - q.lost_probabilities for q in qualities])
    trust[[q is not None and q.is_unseen for q in qualities]] = 0.0
    return FrameTracks(np.array([e.poses[person] for e in found]), trust, without, has_history)
