"""Try frames until the first poses of all people on one of them can be trusted.

Rank frames by cheap evidence: how well the silhouettes agree, and how many show each person alone.
"""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import combinations, product
from typing import NamedTuple

import numpy as np

from tracker.compute.progress import PartPace
from tracker.errors import Remedy, TrackerError
from tracker.estimation.initialization.first_pose import (
    FirstPose,
    FirstPoses,
    FrameTask,
    Silhouettes,
    Source,
    pose_on_frame,
)
from tracker.estimation.initialization.generators.person_scene import PersonScene
from tracker.estimation.initialization.generators.start_generators import GENERATORS
from tracker.estimation.initialization.own_figure import others_on_frame, own_figure
from tracker.estimation.initialization.silhouette_check import is_cut_off
from tracker.estimation.initialization.standing_heights import StandingHeights
from tracker.estimation.initialization.start_fit import short_tracks
from tracker.evidence.observer import Observer
from tracker.evidence.silhouettes import SilhouetteFinder, ViewSilhouette
from tracker.evidence.voxels.figure_masks import figure_masks
from tracker.evidence.voxels.shadows import recover_from_shadows
from tracker.evidence.voxels.visual_hull import carve_people
from tracker.evidence.voxels.voxel_grid import VOXEL_M
from tracker.geometry.ground_plane import GroundPlane, floor_plane
from tracker.session.session import Session

_ENOUGH_FRAMES = 2
"""Number of frames with good starts whose heights agree that end the trial of `auto`."""
_PICTURES = 16
"""Pictures in which `auto` looks for voxels of one person, or otherwise for several: some 20 s of processor time on six
views of 960x540, measured with simulated people."""

Say = Callable[[str], None]
Show = Callable[["Trying"], None]
"""Is given how far a search is when a frame begins or ends, between fits and for each silhouette, from several threads.
An exception ends the search; after `TakenError` it returns the best poses so far."""


class TakenError(Exception):
    """The best poses so far are to be taken; see `Show`."""


class Trying(NamedTuple):
    """How far a search for first poses is."""

    frame: int | None
    """The frame that is tried; None while frames are compared."""
    number: int
    """Which one of the frames this is, from 1."""
    n_frames: int
    """Number of frames that this round tries at most."""
    generators: str
    """Names of those that propose starts in this round; empty for the usual ones."""
    n_figures: int | None
    """Number of people's figures on the frame; None before they are found."""
    left_s: float | None
    """Longest time that the search still takes, s, by what trials took so far; None before the first has ended, and
    while no start is good and other generators may follow."""
    best: FirstPoses | None
    """The best poses so far, of any frame."""

    @property
    def text(self) -> str:
        """A phrase on the frame."""
        if self.frame is None:
            return "comparing frames"
        people = "person's figure" if self.n_figures == 1 else "people's figures"
        seen = "" if self.n_figures is None else f", {self.n_figures} {people} seen"
        by = f" by {self.generators}" if self.generators else ""
        return f"trying frame {self.number} of {self.n_frames}{by}{seen}"

    @property
    def share(self) -> float:
        """Share of the frames of this round that are tried, 0 to 1."""
        return max(0, self.number - 1) / self.n_frames


def find_first_poses(
    session: Session, observer: Observer, people: Sequence[int], frames: Sequence[int],
    generators: Sequence[str] = ("voxels",), size_m: float = VOXEL_M, say: Say = lambda text: None,
) -> FirstPoses:  # fmt: skip
    """Find the poses of some people on one of some frames, on which all stand apart.

    The frame and the starts whose short tracks cost least are kept.

    Args:
        session: the session; nothing is stored.
        observer: of its recording.
        people: indices of the people. Others are where their stored poses are.
        frames: the frames to try; at least one.
        generators: to try on each frame.
        size_m: edge of a voxel, metres.
        say: receives a sentence on each frame that is tried. An exception that it raises ends the search.

    Raises:
        TrackerError: no frame shows the people well enough. The message is that of the first frame.
    """
    with _Trial(session, observer, people, size_m, say) as trial:
        for frame in frames:
            trial.add([frame], generators)
        return trial.best()


def find_first_poses_anywhere(
    session: Session, observer: Observer, people: Sequence[int], frames: Sequence[int], size_m: float = VOXEL_M,
    say: Say = lambda text: None, show: Show = lambda trying: None,
) -> FirstPoses:  # fmt: skip
    """Find first poses by whatever generator and on whatever of some frames tracks best; see `find_first_poses`.

    The cheapest generator is tried until the starts of two frames are good and agree on the heights. A single good one
    is not enough: it may have a limb elsewhere. Frames that are tried in any case are tried at the same time.

    Of one person, frames on which the silhouettes agree best are tried, and the number of pictures bounds theirs. If no
    start is good, the other generators are tried on the frame that costs least, until one finds a start. Several people
    hide one another's limbs: all frames are tried for them, and other generators on several, until a start is good.
    """
    cheapest, *others = GENERATORS
    with _Trial(session, observer, people, size_m, say, show) as trial:
        is_one, few = len(people) == 1, max(_ENOUGH_FRAMES, _PICTURES // len(session.cameras))
        n_again = 1 if is_one else few
        try:
            trial.begin(len(frames), 0)
            left = trial.ranked(frames)[:few] if is_one else list(frames)
            first = left[0]
            trial.begin(len(left), len(others) * n_again)
            while left and not trial.is_settled:
                n_sure = max(1, _ENOUGH_FRAMES - sum(f.is_good for f in trial.found))
                trial.add(left[:n_sure], (cheapest,))
                del left[:n_sure]
            best = [f.frame for f in sorted(trial.found, key=lambda f: f.cost_px)] or [first]
            n_before = len(trial.found)
            trial.begin(len(others) * len(best[:n_again]), 0, " and ".join(others))
            for name, frame in product(others, best[:n_again]):
                if not trial.has_good and (not is_one or len(trial.found) == n_before):
                    trial.add([frame], (name,))
        except TakenError:
            return trial.best()
        try:
            return trial.best()
        except TrackerError as error:
            text = (
                f"expected a frame on which people are found by their silhouettes, found none of {len(frames)}: {error}"
            )
            raise TrackerError(text, Remedy("find_otherwise"), error.camera) from error


class _EndedError(Exception):
    """The trial of another frame has ended the search."""


class _Trial:
    """First poses on the frames that were tried."""

    def __init__(
        self, session: Session, observer: Observer, people: Sequence[int], size_m: float, say: Say,
        show: Show = lambda trying: None,
    ) -> None:  # fmt: skip
        if len(session.cameras) < 2:
            raise TrackerError(
                f"expected two cameras or more to find people, found '{session.cameras[0].camera.name}' alone, which "
                "shows no depth; place the body by hand, or set it from known joints"
            )
        self._show, self._ended = show, threading.Event()
        self.found, self._errors = list[FirstPoses](), list[TrackerError]()
        self._n_figures = dict[int, int]()
        self.begin(1, 0)
        self._session, self._observer, self._people, self._size_m, self._say = session, observer, people, size_m, say
        self._finder = SilhouetteFinder(session.cameras, observer.recording, step=self._step)
        floor = floor_plane(session.up, session.floor)

        def recovered(frame: int, person: int) -> Sequence[ViewSilhouette]:
            return recover_from_shadows(self._finder.silhouettes(frame, person), floor, size_m)

        self._sources = [self._source(silhouettes, floor) for silhouettes in (self._finder.silhouettes, recovered)]

    def __enter__(self) -> "_Trial":
        return self

    def __exit__(self, *_: object) -> None:
        self._finder.close()

    def begin(self, n_frames: int, n_later: int, generators: str = "") -> None:
        """Begin a round of trials.

        Args:
            n_frames: to try at most.
            n_later: number of trials that follow if no start is good.
            generators: names of unusual ones.
        """
        self._frame: int | None = None
        self._pace = PartPace()  # other generators take another time
        self._number, self._n_done, self._n_frames, self._n_later = 0, 0, n_frames, n_later
        self._generators = generators

    def _step(self) -> None:
        if self._ended.is_set():
            raise _EndedError
        best = self.best() if self.found else None
        seen = None if self._frame is None else self._n_figures.get(self._frame)
        is_last = self.has_good or not self._n_later  # nobody knows how long other generators take
        left_s = self._pace.left_s(self._n_frames - self._n_done) if is_last else None
        of = (self._number, self._n_frames, self._generators)
        self._show(Trying(self._frame, *of, seen, left_s, best))

    def _source(self, silhouettes: Silhouettes, floor: GroundPlane) -> "Source":
        def scenes(frame: int, person: int) -> list[PersonScene]:
            self._step()
            views = silhouettes(frame, person)
            return [PersonScene(f, views, (), floor) for f in carve_people(views, self._size_m).figures]

        return Source(silhouettes, StandingHeights(scenes, self._session.n_frames, len(self._session.people)))

    def add(self, frames: Sequence[int], generators: Sequence[str]) -> None:
        """Try frames, each in a thread of its own. They are shown and said in their order; an exception ends all."""
        self._pace.begin()
        with ThreadPoolExecutor(len(frames), "trial") as pool:
            tried = [pool.submit(self._poses_on, frame, generators) for frame in frames]
            try:
                for frame, trial in zip(frames, tried, strict=True):
                    self._frame, self._number = frame, self._number + 1
                    self._step()
                    self._take(frame, generators, trial)
            except BaseException:
                self._ended.set()
                raise
        self._pace.end(len(frames))
        self._n_done += len(frames)
        self._step()

    def _poses_on(self, frame: int, generators: Sequence[str]) -> FirstPoses:
        own: dict[int, FirstPose] = {}
        for person in self._people:
            task = FrameTask(
                self._session, self._observer, self._sources, person, self._size_m, self._step, self._n_figures
            )
            own[person] = pose_on_frame(task, frame, generators, own)
        return FirstPoses(frame, own)

    def _take(self, frame: int, generators: Sequence[str], trial: Future[FirstPoses]) -> None:
        """Wait for the poses of a frame and keep them."""
        try:
            found = trial.result()
        except TrackerError as error:
            self._errors.append(error)
            self._say(f"frame {frame}, {' and '.join(generators)}: {error}")
            return
        self.found.append(found)
        statuses = ", ".join(p.status for p in found.poses.values())
        cost = f"cost {found.cost_px:.2f} px over a short track"
        self._say(f"frame {frame}, {' and '.join(generators)}: {statuses}, {cost}")

    def ranked(self, frames: Sequence[int]) -> list[int]:
        """Return frames, the most promising first; an eighth of the voxels is enough to compare them."""
        first = self._people[0]
        return ranked_frames(
            frames, self._session, first, lambda k: self._finder.silhouettes(k, first), 2 * self._size_m
        )

    @property
    def has_good(self) -> bool:
        """Whether the starts of a frame are good."""
        return any(f.is_good for f in self.found)

    @property
    def is_settled(self) -> bool:
        """Whether two frames have good starts that agree on the heights of all, in whatever order people are."""
        good = [f for f in self.found if f.is_good]
        return any(a.has_heights_of(b) for a, b in combinations(good, _ENOUGH_FRAMES))

    def best(self) -> FirstPoses:
        """Return the first poses that cost least; those whose fits are good go before.

        A start at an end of the recording is compared by one short track alone, so that other frames go before it, too.

        Raises:
            TrackerError: there are none.
        """
        if not self.found:
            raise self._errors[0]
        n_frames = self._session.n_frames
        return min(self.found, key=lambda f: (not f.is_good, len(short_tracks(f.frame, n_frames)) < 2, f.cost_px))


def ranked_frames(
    frames: Sequence[int], session: Session, person: int, silhouettes_on: Callable[[int], Sequence[ViewSilhouette]],
    size_m: float,
) -> list[int]:  # fmt: skip
    """Return frames, first those on which silhouettes agree in most views that show each person alone.

    Args:
        frames: to rank.
        session: with the poses of others, where figures are of them.
        person: index of a person who must have a figure.
        silhouettes_on: returns the silhouettes of all views by frame.
        size_m: edge of a voxel, metres.
    """

    def agreement(frame: int) -> float:
        silhouettes = silhouettes_on(frame)
        try:
            hull = carve_people(silhouettes, size_m)
            own_figure(session, person, hull, others_on_frame(session, person, frame, {}))
        except TrackerError:
            return 0.0
        coverages, figures, shown = np.nan_to_num(hull.coverages), hull.figures[: len(session.people)], list[float]()
        for figure in figures:
            masks = figure_masks(silhouettes, figure, [f for f in figures if f is not figure])
            alone = np.array([m.shows_figure_alone and not is_cut_off(m.mask) for m in masks])
            shown.append(float(coverages @ alone))
        return min(shown)

    return sorted(frames, key=agreement, reverse=True)
