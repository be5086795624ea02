"""Detect the people of a session: the points of all figures in all views, stored as observations."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from tracker.compute.progress import Report, unreported
from tracker.errors import SessionError, TrackerError
from tracker.footage.recording import Recording
from tracker.formats.joint_maps import JointMap, known_joint_maps
from tracker.geometry.arrays import Array, Image
from tracker.geometry.ground_plane import floor_plane
from tracker.interchange.detection.detector import Detector
from tracker.interchange.detection.people_in_views import PeopleInViews, Seen, points_of
from tracker.interchange.observations.identities import everybody
from tracker.interchange.observations.observed import ObservationSet, ObservedPoints, bones_of
from tracker.interchange.observations.stored import list_observations, load_observations, new_folder, save_observations
from tracker.interchange.observations.stored_masks import describe_masks, masks_folder, write_mask
from tracker.session.session import Session

FORMAT = "detection"
"""Format of observations that were detected here: they have no files."""


Show: TypeAlias = Callable[[int, Callable[[], ObservationSet]], None]
"""Is given each frame on which people were sought, and what returns the people of that frame as observations."""


@dataclass(frozen=True)
class DetectionPlan:
    """Frames to detect people on, and the name under which they are stored."""

    name: str
    """Name of the observations."""
    detector: str
    """Name of the detector and of its model, which are stored."""
    frames: range
    """Frames of the session, ascending."""
    masks: bool = False
    """Whether masks of the people are stored too, under the name with `_masks` behind. No camera uses them yet."""


@dataclass(frozen=True)
class Detected:
    """The outcome of a detection."""

    frames: range
    """Frames that were detected, now or before."""
    is_complete: bool
    """Whether these are all frames of the plan."""
    n_figures: tuple[int, ...]
    """Pictures of each view that show a person, by view."""
    n_people: int
    """Number of people who are seen at once, to compare with that of the session."""
    notes: tuple[str, ...]
    """Sentences on what is remarkable."""


def detect_people(
    session: Session, recording: Recording, detector: Detector, plan: DetectionPlan, report: Report = unreported,
    show: Show = lambda frame, found: None,
) -> Detected:  # fmt: skip
    """Detect people on the frames of a plan, and store what was found; also if it is stopped.

    A detection that was stopped goes on where it ended.

    Args:
        session: the session, which this process has locked.
        recording: its footage.
        detector: sees a picture.
        plan: what to detect.
        report: shows progress. A KeyboardInterrupt that it raises stops the work.
        show: shows what is found.

    Raises:
        TrackerError: the name is taken by other observations, the footage cannot be read, or nobody is seen.
    """
    before = _begun(session, plan)
    convention = next(m for m in known_joint_maps() if m.name == detector.skeleton)
    at = {marker: i for i, marker in enumerate(convention.points)}
    columns = {point: at[marker] for point, marker in convention.markers.items() if marker in at}
    cameras = [c.camera for c in session.cameras]
    up = floor_plane(session.up, session.floor).normal
    people = PeopleInViews(detector, columns, len(convention.points), cameras, up, session.fps)
    found = {} if before is None else people.recall(before)
    masks = _MaskWriter(session, f"{plan.name}_masks", goes_on=before is not None) if plan.masks else None
    todo = [k for k in plan.frames if k not in found]
    try:
        for i, k in enumerate(todo):
            report("detecting people", i / len(todo))
            pictures = recording.read(k)
            figures = people.see(k, pictures)
            if masks is not None:
                masks.write(k, [people.mask(k, v, own) for v, own in enumerate(figures)], pictures)
            found[k] = [[replace(figure, mask=None) for figure in own] for own in figures]  # masks fill the memory
            here, only = {k: found[k]}, range(k, k + 1)
            show(k, lambda here=here, only=only: _observations(session, plan, convention, here, only))
    except KeyboardInterrupt:
        pass
    if not any(own for views in found.values() for own in views):
        raise TrackerError(
            f"expected people in the pictures of frames {plan.frames.start} to {plan.frames.stop - 1}, found none; "
            "look at the footage, try another model, or place the bodies by hand"
        )
    if not people.tracks:
        alone = " and ".join(n for v, n in enumerate(people.names) if any(views[v] for views in found.values()))
        raise TrackerError(
            f"expected people whom two views show at one place, found those of {plan.detector} in {alone} at none; "
            "check the calibration and the offsets of the views, or try another model"
        )
    done = range(plan.frames.start, max(found) + 1)
    observations = _observations(session, plan, convention, found, done)
    notes = _notes(people, observations, len(session.people), done)
    save_observations(session, replace(observations, notes=notes), {}, replaces=before is not None)
    if masks is not None:
        describe_masks(session, masks.name, FORMAT, {"detector": plan.detector, "detected": _text(done)})
    counts = tuple(sum(bool(views[v]) for views in found.values()) for v in range(len(cameras)))
    return Detected(done, len(found) == len(plan.frames), counts, people.number, notes)


class _MaskWriter:
    """Writes masks one by one."""

    def __init__(self, session: Session, name: str, goes_on: bool) -> None:
        """Prepare the folder, which is there already if a detection goes on.

        Raises:
            SessionError: others have the name.
        """
        self.name, self._cameras, self._folder = name, session.cameras, masks_folder(session, name)
        if not goes_on:
            new_folder(session, name)

    def write(self, k: int, masks: Sequence[NDArray[np.uint8]], pictures: Sequence[Image | None]) -> None:
        """Write the masks of a frame, (H, W) each, of the views that have a picture.

        Raises:
            SessionError: they cannot be written.
        """
        try:
            for source, mask, picture in zip(self._cameras, masks, pictures, strict=True):
                folder = self._folder / source.camera.name
                folder.mkdir(parents=True, exist_ok=True)
                if picture is not None:
                    write_mask(folder, k + source.offset, mask)
        except OSError as error:
            raise SessionError(f"cannot write {self._folder}: {error}; free some space, and detect again") from error


def _begun(session: Session, plan: DetectionPlan) -> ObservationSet | None:
    """Return what an earlier detection by the same plan has stored; None if there is none.

    Raises:
        TrackerError: there are other observations of this name, or it is complete.
    """
    if plan.name not in list_observations(session):
        return None
    stored = load_observations(session, plan.name)
    options = dict(stored.options)
    if stored.format != FORMAT or options["detector"] != plan.detector or options["frames"] != _text(plan.frames):
        found = f"those of {stored.format}" + f", {options['detector']}" * ("detector" in options)
        raise TrackerError(f"expected a free name, found '{plan.name}' taken by {found}; choose another name")
    if options["detected"] == options["frames"]:
        raise TrackerError(f"expected a free name, found '{plan.name}', which is complete; choose another name")
    return stored


def complete_detection(session: Session, detector: str, frames: range, name: str | None = None) -> str | None:
    """Return the name of stored observations by a detector on these frames; None if there are none.

    Args:
        session: the session.
        detector: see `DetectionPlan`.
        frames: see `DetectionPlan`.
        name: that they must have; None for any.
    """
    options = {"detector": detector, "frames": _text(frames), "detected": _text(frames)}
    stored = (load_observations(session, own) for own in list_observations(session) if name in (None, own))
    return next((s.name for s in stored if s.format == FORMAT and dict(s.options) == options), None)


def open_name(session: Session, name: str, detector: str, frames: range) -> str:
    """Return a name for a detection: one that is free, or that of one of the same plan that was stopped.

    Args:
        session: the session.
        name: to begin with; a number is added to it.
        detector: see `DetectionPlan`.
        frames: see `DetectionPlan`.
    """
    for number in count(1):
        tried = name if number == 1 else f"{name} {number}"
        try:
            _begun(session, DetectionPlan(tried, detector, frames))
        except TrackerError:
            continue
        return tried
    raise AssertionError


def _text(frames: range) -> str:
    return f"{frames.start}:{frames.stop}"


def _observations(
    session: Session, plan: DetectionPlan, convention: JointMap, found: dict[int, Seen], done: range
) -> ObservationSet:
    names = [c.camera.name for c in session.cameras]
    n = max(len(own) for views in found.values() for own in views)
    shape = session.n_frames, len(names), n, len(convention.points)
    px, confidence, colors = np.full((*shape, 2), np.nan), np.zeros(shape), np.full((*shape[:3], 6), np.nan)
    for k, seen in found.items():
        px[k], confidence[k] = points_of(seen, len(convention.points), n)
        for v, own in enumerate(seen):
            colors[k, v, : len(own)] = [figure.colors for figure in own] or np.empty((0, 6))
    options = ("detector", plan.detector), ("frames", _text(plan.frames)), ("detected", _text(done))
    points = ObservedPoints(convention.points, tuple(names), px, confidence, colors=colors)
    rows: Array = np.array(sorted(found), dtype=np.float64)
    people = tuple(p.name for p in session.people)
    return ObservationSet(plan.name, FORMAT, people, convention, points, None, (rows,), options=options)


def _notes(people: PeopleInViews, observations: ObservationSet, n: int, done: range) -> tuple[str, ...]:
    """Say whether other people than the `n` of the session are seen, and who is not seen all the time."""
    points = observations.points
    assert points is not None
    assert points.colors is not None
    out, everyone = [], everybody(people.tracks, bones_of(observations), points.colors)
    if people.number < n:
        out.append(f"{people.number} of {n} people are seen at once by three views or by all")
    elif people.number > n:
        out.append(
            f"{people.number} people are seen at once by three views or by all, the session has {n}: "
            "those seen most are taken"
        )
    for person in everyone[:n]:
        first, last = min(person.members)[0], max(person.members)[0]
        if first - done.start >= people.every or done.stop - last > people.every:
            out.append(f"a person is seen on frames {first} to {last} alone")
    for i, person in enumerate(everyone):
        if len({k for k, _ in person.members}) >= people.every and (person.is_flat or i >= n):
            who = "a flat picture of a person" if person.is_flat else "a further person"
            names = " and ".join(people.names[v] for v in sorted({v for _, v in person.members}))
            out.append(f"{who} is seen by {names}" + ", and left out" * (i >= n))
    return tuple(out)
