"""Find the first pose of a person on one frame of a session with nobody's help.

Generators propose start poses, one for each way of facing. Each is fitted to the contours. The best are searched around
and tracked over a few frames in both directions. The most likely track is kept. It is doubtful where another start is
as likely, or where it loses the person. First poses that other evidence shows are fitted and tracked alike.
"""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple, TypeAlias

import numpy as np

from tracker.body.limbs import limb_display_name, limbs
from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.estimation.fitting.hypothesis import BEAM_NATS, CLEAR_NATS, Hypothesis, distinct, limbs_elsewhere
from tracker.estimation.initialization.generators.person_scene import PersonScene, silhouette_axes
from tracker.estimation.initialization.generators.start_generators import GENERATORS
from tracker.estimation.initialization.generators.stature import HEIGHT_SIGMA
from tracker.estimation.initialization.own_figure import others_on_frame, own_figure
from tracker.estimation.initialization.silhouette_check import (
    check_against_silhouettes,
    is_cut_off,
    starts_in_silhouettes,
)
from tracker.estimation.initialization.standing_heights import StandingHeights
from tracker.estimation.initialization.start_fit import StartFitter, StartTrack, short_tracks, track_back
from tracker.estimation.tracking.confidence import Status, worst
from tracker.evidence.observer import Observer
from tracker.evidence.silhouettes import ViewSilhouette
from tracker.evidence.voxels.figure_masks import STRAY, figure_masks
from tracker.evidence.voxels.visual_hull import VisualHull, carve_people
from tracker.formats.model_toml import has_preset_sizes
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import floor_plane
from tracker.session.session import Session

_HEIGHTS_AGREE = 2 * np.sqrt(2) * HEIGHT_SIGMA
"""Largest difference of the logarithms of two heights that agree: 95% of pairs of one person do."""
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


class Source(NamedTuple):
    """Silhouettes of a recording, and the heights of the people whom they show."""

    silhouettes: Silhouettes
    heights: StandingHeights


class FrameTask(NamedTuple):
    """A person to look for, and what is known of the recording."""

    session: Session
    observer: Observer
    sources: Sequence[Source]
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


def pose_on_frame(
    task: FrameTask, frame: int, generators: Sequence[str], found: Mapping[int, FirstPose]
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
    """Return whether some silhouette grows by more than stray pixels, so that it is worth another start."""
    areas, areas_before = (np.array([np.count_nonzero(s.mask) for s in own]) for own in (silhouettes, before))
    return bool(np.any(areas > (1 + STRAY) * areas_before))


def _on_frame(
    task: FrameTask, frame: int, source: Source, silhouettes: Sequence[ViewSilhouette],
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
    compared = compare_starts(fitter, proposals, lambda tracks: starts_in_silhouettes(tracks, silhouettes, masks))
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


_N_SEARCHED = 4
"""Starts of a frame that are searched around."""


class ComparedStarts(NamedTuple):
    """The starts of a person, compared."""

    searched: list[Hypothesis]
    """The starts that were searched, with their costs on the frame, the best first."""
    tracked: list[StartTrack]
    """The starts that were tracked and fill the silhouettes, with their costs on all frames, the best first."""
    is_lost: bool
    """Whether the person is lost on a short track from the best."""

    @property
    def is_facing_sure(self) -> bool:
        """Whether the contours tell left from right."""
        best = self.tracked[0].start
        tracked, searched = (
            [s.cost for s in own if s.faces_away_from(best)] for own in ([t.start for t in self.tracked], self.searched)
        )
        gaps = [c - best.cost for c in tracked] or [c - self.searched[0].cost for c in searched]
        return bool(gaps) and min(gaps) > CLEAR_NATS

    @property
    def rivals_note(self) -> str:
        """A sentence on the limbs that are elsewhere in starts about as good as the best; empty if none is."""
        best, *others = (t.start for t in self.tracked)
        close = [o for o in others if o.cost < best.cost + CLEAR_NATS]
        found = {limb for o in close for limb in limbs_elsewhere(best.body, o.body)}
        names = [limb_display_name(limb.name) for limb in limbs(best.model) if limb.name in found]
        return f"another start is about as good, with {', '.join(names)} elsewhere" if names else ""


def compare_starts(
    fitter: StartFitter, proposals: Sequence[Hypothesis], filling: Callable[[Sequence[StartTrack]], list[StartTrack]]
) -> ComparedStarts:
    """Fit, search and track starts. A different pose after tracking there and back is another start."""
    tried = distinct(fitter.scored([fitter.fit(p) for p in proposals]))
    kept, rest = tried[:_N_SEARCHED], tried[_N_SEARCHED:]
    if not any(h.faces_away_from(kept[0]) for h in kept):
        kept += [h for h in rest if h.faces_away_from(kept[0])][:1]
    searched = distinct(fitter.scored([fitter.search(h) for h in kept]))
    runs = [fitter.track(h) for h in searched if h.cost < searched[0].cost + BEAM_NATS]
    best, *_ = tracked = filling(fitter.compared(runs))
    returned, is_lost = track_back(best)
    if returned:
        runs += [fitter.track(fitter.search(h)) for h in returned]
        tracked = filling(fitter.compared(runs))
    return ComparedStarts(searched, tracked, is_lost if tracked[0].poses is best.poses else tracked[0].is_lost)


def fit_to_contours(
    session: Session, observer: Observer, found: FirstPoses, step: Callable[[], None] = lambda: None
) -> FirstPoses:
    """Fit first poses to the contours of their frame, one person after the other.

    A person whose fit is not good, or who is lost on a short track from there, keeps the pose: contours in clutter lead
    it away.

    Args:
        session: the session; nothing is stored.
        observer: of its recording.
        found: the first poses.
        step: called after each frame that is fitted. An exception that it raises ends the work.
    """
    poses = dict(found.poses)
    for person, first in found.poses.items():
        others = others_on_frame(session, person, found.frame, {i: p.start.body for i, p in poses.items()})
        fitter = StartFitter(observer, found.frame, short_tracks(found.frame, session.n_frames), tuple(others), step)
        track = fitter.track(first.start)
        if track.status == "good" and not track.is_lost:
            poses[person] = first._replace(start=track.start, status=track.status, cost_px=track.cost_px)
    return FirstPoses(found.frame, poses)
