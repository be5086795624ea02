"""Find the first pose of a person in a session with nobody's help, and store it.

On each frame that is tried generators propose start poses, one for each way of
facing. Each is fitted to the contours. The best are searched around and tracked over a few frames in both directions.
The most likely track is kept. It is doubtful where another start is as likely, or where it loses the person.
"""

import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import combinations, product
from types import MappingProxyType
from typing import NamedTuple, TypeAlias

import numpy as np

from tracker.body.model import BodyModel
from tracker.compute.progress import PartPace
from tracker.errors import Remedy, TrackerError
from tracker.estimation.fitting.hypothesis import Hypothesis
from tracker.estimation.initialization.frame_ranking import ranked_frames
from tracker.estimation.initialization.generators.person_scene import PersonScene, silhouette_axes
from tracker.estimation.initialization.generators.start_generators import GENERATORS
from tracker.estimation.initialization.generators.stature import HEIGHT_SIGMA
from tracker.estimation.initialization.own_figure import others_on_frame, own_figure
from tracker.estimation.initialization.silhouette_check import check_against_silhouettes, filling, is_cut_off
from tracker.estimation.initialization.standing_heights import StandingHeights
from tracker.estimation.initialization.start_choice import compare_starts
from tracker.estimation.initialization.start_fit import StartFitter, StartTrack, short_tracks
from tracker.estimation.tracking.confidence import Status, worst
from tracker.evidence.observer import Observer
from tracker.evidence.silhouettes import SilhouetteFinder, ViewSilhouette
from tracker.evidence.voxels.figure_masks import figure_masks
from tracker.evidence.voxels.shadows import recover_from_shadows
from tracker.evidence.voxels.visual_hull import VisualHull, carve_people
from tracker.evidence.voxels.voxel_grid import VOXEL_M
from tracker.formats.model_toml import has_preset_sizes
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import GroundPlane, floor_plane
from tracker.session.session import Session

_ENOUGH_FRAMES = 2
"""Number of frames with good starts whose heights agree that end the trial of `auto`."""
_PICTURES = 16
"""Pictures in which `auto` looks for voxels of one person, or otherwise for several: some 20 s of processor time on six
views of 960x540, measured with simulated people."""
_HEIGHTS_AGREE = 2 * np.sqrt(2) * HEIGHT_SIGMA
"""Largest difference of the logarithms of two heights that agree: 95% of pairs of one person do."""
_LARGER = 0.02
"""Share by which some silhouette grows with what looks like shadows, above which it is worth another start."""

Say = Callable[[str], None]
Show = Callable[["Trying"], None]
"""Is given how far a search is when a frame begins or ends, between fits and for each silhouette, from several threads.
An exception ends the search; after `TakenError` it returns the best poses so far."""
Silhouettes: TypeAlias = Callable[[int, int], Sequence[ViewSilhouette]]
"""Returns the silhouettes of all views by frame and by index of the person whose masks are used."""


class FirstPose(NamedTuple):
    """A first pose and how it was found."""

    frame: int
    start: Hypothesis
    """The pose and the body, whose height may have been measured."""
    status: Status
    """The tracker's status of the fit on that frame, at best doubtful if silhouettes, rivals or a track object."""
    cost_px: float
    """Mean cost of the short track, px of the footage; NaN of a pose that was not tracked."""
    is_facing_sure: bool
    """Whether the contours tell left from right."""
    notes: tuple[str, ...]
    """Sentences on what is not sure."""
    lines_px: Mapping[str, Array] = MappingProxyType({})
    """Successive approximations to the major axis of the silhouette in each view that shows the person alone (GD96
    Fig. 5): ends in undistorted px of the footage, (n_rounds, 2, 2) each."""

    @property
    def model(self) -> BodyModel:
        """The body."""
        return self.start.model


class FirstPoses(NamedTuple):
    """The first poses of several people on one frame."""

    frame: int
    poses: dict[int, FirstPose]
    """By index of the person."""

    @property
    def cost_px(self) -> float:
        """Mean cost of their short tracks, px of the footage."""
        return float(np.mean([p.cost_px for p in self.poses.values()]))

    @property
    def is_good(self) -> bool:
        """Whether the fits of all are good."""
        return all(p.status == "good" for p in self.poses.values())

    @property
    def is_credible(self) -> bool:
        """Whether nobody is lost in them."""
        return all(p.status != "lost" for p in self.poses.values())

    def has_heights_of(self, other: "FirstPoses") -> bool:
        """Return whether the heights agree with those on another frame, where the people may come in another order."""
        ours, theirs = (np.sort([p.model.height_m for p in found.poses.values()]) for found in (self, other))
        return bool(np.all(np.abs(np.log(ours / theirs)) < _HEIGHTS_AGREE))


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
    """Longest time that the search still takes, s, by what trials took so far; None before the first has ended."""
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
        self._pace, self._n_figures = PartPace(), dict[int, int]()
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
        self._number, self._n_done, self._n_frames, self._n_later = 0, 0, n_frames, n_later
        self._generators = generators

    def _step(self) -> None:
        if self._ended.is_set():
            raise _EndedError
        n_left = self._n_frames - self._n_done + (0 if self.has_good else self._n_later)
        best = self.best() if self.found else None
        seen = None if self._frame is None else self._n_figures.get(self._frame)
        left_s, of = self._pace.left_s(n_left), (self._number, self._n_frames, self._generators)
        self._show(Trying(self._frame, *of, seen, left_s, best))

    def _source(self, silhouettes: Silhouettes, floor: GroundPlane) -> "_Source":
        def scenes(frame: int, person: int) -> list[PersonScene]:
            self._step()
            views = silhouettes(frame, person)
            return [PersonScene(f, views, (), floor) for f in carve_people(views, self._size_m).figures]

        return _Source(silhouettes, StandingHeights(scenes, self._session.n_frames, len(self._session.people)))

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
            task = _Task(
                self._session, self._observer, self._sources, person, self._size_m, self._step, self._n_figures
            )
            own[person] = _best_on_frame(task, frame, generators, own)
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


class _Source(NamedTuple):
    """Silhouettes of a recording, and the heights of the people whom they show."""

    silhouettes: Silhouettes
    heights: StandingHeights


class _Task(NamedTuple):
    session: Session
    observer: Observer
    sources: Sequence[_Source]
    """The silhouettes as each view finds them, then those with what looks like shadows."""
    person: int
    size_m: float
    step: Callable[[], None]
    n_figures: dict[int, int]
    """Receives the number of figures by frame."""


class _Tried(NamedTuple):
    """A first pose by one way to find silhouettes."""

    pose: FirstPose
    track: StartTrack
    fitter: StartFitter


def _best_on_frame(
    task: _Task, frame: int, generators: Sequence[str], found: Mapping[int, FirstPose]
) -> FirstPose:  # fmt: skip
    """Return the pose on a frame; where it is not good, the more likely one of that and of silhouettes with shadows."""
    tried, errors, before = list[_Tried](), list[TrackerError](), None
    for source in task.sources if next(iter(GENERATORS)) in generators else task.sources[:1]:
        silhouettes = source.silhouettes(frame, task.person)
        if before is not None and not _are_larger(silhouettes, before):
            break
        before = silhouettes
        try:
            tried.append(_on_frame(task, frame, source, silhouettes, generators, found))
        except TrackerError as error:
            errors.append(error)
        if tried and tried[-1].pose.status == "good":
            break
    if not tried:
        raise errors[0]
    best, *_ = tried[0].fitter.compared([t.track for t in tried])
    return next(t.pose for t in tried if t.track.poses is best.poses)


def _are_larger(silhouettes: Sequence[ViewSilhouette], before: Sequence[ViewSilhouette]) -> bool:
    areas, areas_before = (np.array([np.count_nonzero(s.mask) for s in own]) for own in (silhouettes, before))
    return bool(np.any(areas > (1 + _LARGER) * areas_before))


def _on_frame(
    task: _Task, frame: int, source: _Source, silhouettes: Sequence[ViewSilhouette],
    generators: Sequence[str], found: Mapping[int, FirstPose],
) -> _Tried:  # fmt: skip
    session, observer, _, person, size_m, step, n_figures = task
    hull = carve_people(silhouettes, size_m)
    n_figures[frame] = len(hull.figures)
    known = {i: pose.start.body for i, pose in found.items()}
    others = others_on_frame(session, person, frame, known)
    figure = own_figure(session, person, hull, others)
    silhouettes = [s for s in silhouettes if s.camera.name not in hull.broken]
    masks = figure_masks(silhouettes, figure, [f for f in hull.figures if f is not figure])
    scene = PersonScene(figure, silhouettes, masks, floor_plane(session.up, session.floor))
    model = session.people[person].model
    height_m = source.heights.around(scene, frame, person) if has_preset_sizes(model) else None
    proposals = _proposals(scene, model if height_m is None else model.with_height(height_m), generators)
    fitter = StartFitter(observer, frame, short_tracks(frame, session.n_frames), tuple(others), step)
    compared = compare_starts(fitter, proposals, lambda tracks: filling(tracks, silhouettes, masks))
    best = compared.tracked[0]
    notes = _notes(best.start, compared.is_facing_sure, hull, silhouettes)
    doubts = [
        check_against_silhouettes(best.start.body, silhouettes, masks).note,
        compared.rivals_note,
        "the person is lost on a short track from here" if compared.is_lost else "",
    ]
    status = worst([best.status, "doubtful"]) if any(doubts) else best.status
    notes = (*notes, *filter(None, doubts))
    lines = _lines_px(session, scene)
    pose = FirstPose(frame, best.start, status, best.cost_px, compared.is_facing_sure, notes, lines)
    return _Tried(pose, best, fitter)


def _proposals(scene: PersonScene, model: BodyModel, generators: Sequence[str]) -> list[Hypothesis]:
    """Return the starts of all generators; those that fail are left out unless all do."""
    found, errors = list[Hypothesis](), list[TrackerError]()
    is_known = not has_preset_sizes(model)
    for name in generators:
        try:
            found += GENERATORS[name](scene, model, is_known)
        except TrackerError as error:
            errors.append(error)
    if not found:
        raise errors[0]
    return found


def _lines_px(session: Session, scene: PersonScene) -> dict[str, Array]:
    """Return the axes of the silhouettes by view, undistorted px of the footage; empty if fewer than two have one."""
    try:
        axes = silhouette_axes(scene)
    except TrackerError:
        return {}
    widths = {c.camera.name: c.camera.pinhole.width for c in session.cameras}
    return {a.camera.name: a.lines_px * (widths[a.camera.name] / a.camera.width) for a in axes}


def _notes(
    start: Hypothesis, is_sure: bool, hull: VisualHull, silhouettes: Sequence[ViewSilhouette]
) -> tuple[str, ...]:
    notes = list(start.notes)
    if not is_sure:
        notes.append("left and right are not sure: a pose that faces the other way is about as good")
    if hull.broken:
        why = "something covers the person there" if hull.is_covered else "check whether its camera has moved"
        notes.append(f"view {hull.broken[0]} was left out: the others agree without it; {why}")
    if not start.is_measured:
        notes.append(f"the height stays {start.model.height_m:.2f} m: the person does not stand upright")
    cut = [s.camera.name for s in silhouettes if is_cut_off(s.mask)]
    if cut:
        notes.append(f"cut off by the image in view {', '.join(cut)}")
    return tuple(notes)
