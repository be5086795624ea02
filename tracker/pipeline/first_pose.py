"""Find the first pose of a person in a session with nobody's help (MTHC01 Sect. 3), and store it."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.errors import TrackerError
from tracker.evidence.observer import Observer
from tracker.evidence.silhouettes import SilhouetteFinder, ViewSilhouette
from tracker.formats.model_toml import format_model
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import up_rotation
from tracker.initialization.start_fit import FittedStart, fit_starts
from tracker.initialization.voxel_start import FigureParts, locate_parts, measured_height, start_pose, turned_round
from tracker.pipeline.body_acquisition import has_preset_sizes
from tracker.session.session import Session, save_session
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import PoseChange, PoseRecord
from tracker.store.stored_poses import read_stored_poses
from tracker.voxels.visual_hull import VisualHull, carve_people
from tracker.voxels.voxel_grid import Voxels

VOXEL_M = 0.025
"""Edge of a voxel, metres."""
_TRACK_FRAMES = (3, 6)
"""Frames after (or before) the first pose over which starts are compared."""
_OWN_M = 0.4
"""A figure that is closer to the trunk of another person with a pose is that person, metres."""
_MAX_HULL_M3 = 0.25
"""Largest volume of the visual hull of one person, cubic metres: three times that of a large man."""

Say = Callable[[str], None]


class FirstPose(NamedTuple):
    """A first pose and how it was found."""

    frame: int
    model: BodyModel
    """The body; of another height than before where it was measured."""
    parts: FigureParts
    """What the voxels show."""
    start: Array
    """Pose before the fit to contours, (n_values,)."""
    fitted: FittedStart
    notes: tuple[str, ...]
    """Sentences on what is not sure."""


def find_first_pose(
    session: Session, observer: Observer, person: int, frames: Sequence[int], size_m: float = VOXEL_M,
    say: Say = lambda text: None,
) -> FirstPose:  # fmt: skip
    """Find the pose of a person on one of some frames from the voxels of the silhouettes.

    Where several frames are given, the one whose short track costs least is kept.

    Args:
        session: the session; nothing is stored.
        observer: of its recording.
        person: index of the person.
        frames: the frames to try; at least one.
        size_m: edge of a voxel, metres.
        say: receives a sentence on each frame that is tried.

    Raises:
        TrackerError: no frame shows the person well enough. The message is that of the first frame.
    """
    finder = SilhouetteFinder(session.cameras, observer.recording)
    found, errors = list[FirstPose](), list[TrackerError]()
    try:
        for frame in frames:
            try:
                found.append(_on_frame(session, observer, finder, person, frame, size_m))
            except TrackerError as error:
                errors.append(error)
                say(f"frame {frame}: {error}")
                continue
            last = found[-1]
            say(f"frame {frame}: {last.fitted.status}, cost {last.fitted.cost_px:.2f} px over a short track")
    finally:
        finder.close()
    if not found:
        raise errors[0]
    return min(found, key=lambda f: f.fitted.cost_px)


def store_first_pose(session: Session, store: AnnotationStore, person: int, found: FirstPose, method: str) -> None:
    """Store a first pose, and make the measured height that of the person.

    Args:
        session: the session, which this process has locked.
        store: its annotations.
        person: index of the person.
        found: the pose.
        method: name of the method, for the history.
    """
    who = session.people[person]
    if found.model is not who.model:
        people = tuple(replace(p, model=found.model) if i == person else p for i, p in enumerate(session.people))
        save_session(replace(session, people=people))
    revision = store.add_model_revision(who.name, format_model(found.model))
    pose = found.fitted.pose
    record = PoseRecord(
        pose, ("searched",) * len(pose), revision, status=found.fitted.status, settings={"method": method},
        remark="; ".join(found.notes),
    )  # fmt: skip
    store.commit(f"init from {method}, frame {found.frame}", [PoseChange(who.name, found.frame, record)])


def _on_frame(
    session: Session, observer: Observer, finder: SilhouetteFinder, person: int, frame: int, size_m: float
) -> FirstPose:
    last = session.n_frames - 1
    step = 1 if frame + _TRACK_FRAMES[-1] <= last else -1
    track = [k for k in (frame, *(frame + step * d for d in _TRACK_FRAMES)) if 0 <= k <= last]
    silhouettes = finder.silhouettes(frame, person)
    hull = carve_people(silhouettes, size_m)
    others = _others(session, person, frame)
    figure = _own_figure(session, person, hull, others)
    parts = locate_parts(figure, _motion(finder, figure, person, track, size_m) if len(track) > 1 else None)
    model, height_note = _sized(session, person, parts)
    both = [parts] if parts.is_facing_sure else [parts, turned_round(parts)]
    starts = [start_pose(model, p) for p in both]
    models = [model, *(b.model for b in others)]
    poses = [starts[0], *(b.values for b in others)]
    fitted = fit_starts(observer, models, 0, starts, track, poses)
    kept = both[fitted.start]
    notes = (*_notes(kept, hull, silhouettes), *height_note)
    return FirstPose(frame, model, kept, starts[fitted.start], fitted, notes)


def _others(session: Session, person: int, frame: int) -> list[PosedBody]:
    """Return the other people who have a pose on a frame."""
    found = []
    for i, other in enumerate(session.people):
        stored = read_stored_poses(session.annotations_path, other.name, other.model, range(frame, frame + 1))
        if i != person and frame in stored:
            found.append(stored[frame].body)
    return found


def _own_figure(session: Session, person: int, hull: VisualHull, others: Sequence[PosedBody]) -> Voxels:
    """Return the largest figure that nobody else has a pose in.

    Raises:
        TrackerError: there are more figures than people, or none is left.
    """
    figures, n_people = hull.figures, len(session.people)
    if len(figures) > n_people:
        raise TrackerError(
            f"expected {n_people} person{'s' * (n_people > 1)} as the session has, found {len(figures)} figures that "
            "stand apart; make the session with all --people, or give masks of the person"
        )
    free = [f for f in figures if not any(_is_in(f, body) for body in others)]
    if not free:
        raise TrackerError(
            f"expected a figure of '{session.people[person].name}', found only those of people who have a pose on this "
            "frame; choose another --frame, on which all stand apart"
        )
    if (len(figures) < n_people and free[0].volume_m3 > _MAX_HULL_M3) or len(free) + len(others) < n_people:
        raise TrackerError(
            f"expected {n_people} figures that stand apart, found {len(figures)}; choose another --frame, on which "
            "people do not touch"
        )
    if free[0].volume_m3 > _MAX_HULL_M3:
        raise TrackerError(
            f"expected one person of at most {1000 * _MAX_HULL_M3:.0f} litres, found a figure of "
            f"{1000 * free[0].volume_m3:.0f}; several people may touch, or views may be too few; choose another --frame"
        )
    return free[0]


def _is_in(figure: Voxels, body: PosedBody) -> bool:
    trunk = body.points_world.mean(axis=0)
    return bool(np.linalg.norm(figure.points_world.mean(axis=0) - trunk) < _OWN_M)


def _motion(finder: SilhouetteFinder, figure: Voxels, person: int, track: Sequence[int], size_m: float) -> Array | None:
    """Return the way of a figure from the first to the last frame of a track, (3,); None if it cannot be found."""
    try:
        later = carve_people(finder.silhouettes(track[-1], person), 2 * size_m).figures
    except TrackerError:
        return None
    begin = figure.points_world.mean(axis=0)
    ways = [f.points_world.mean(axis=0) - begin for f in later]
    return min(ways, key=lambda way: float(np.linalg.norm(way))) * np.sign(track[-1] - track[0])


def _sized(session: Session, person: int, parts: FigureParts) -> tuple[BodyModel, tuple[str, ...]]:
    """Return the body with the measured height where nobody has said how tall the person is, and a note without it."""
    model = session.people[person].model
    if not has_preset_sizes(model):
        return model, ()
    height_m = measured_height(parts, up_rotation(session.up, session.floor)[:, 2])
    if height_m is None:
        return model, (f"the height stays {model.height_m:.2f} m: the person does not stand upright",)
    return model.with_height(height_m), ()


def _notes(parts: FigureParts, hull: VisualHull, silhouettes: Sequence[ViewSilhouette]) -> tuple[str, ...]:
    notes = []
    if not parts.is_facing_sure:
        notes.append("left and right are not sure: feet, bends and motion do not tell them apart")
    if parts.unresolved:
        listed = ", ".join(n.replace("_", " ") for n in parts.unresolved)
        notes.append(f"not resolved by the voxels, which show them as one with the body: {listed}")
    if parts.straight:
        listed = ", ".join(n.replace("_", " ") for n in parts.straight)
        notes.append(f"straight, with the middle joint by usual proportions: {listed}")
    if hull.broken:
        notes.append(f"view {hull.broken[0]} was left out: the others agree without it; check whether it has moved")
    cut = [s.camera.name for s in silhouettes if _is_cut_off(s)]
    if cut:
        notes.append(f"cut off by the image in view {', '.join(cut)}")
    return tuple(notes)


def _is_cut_off(silhouette: ViewSilhouette) -> bool:
    mask = silhouette.mask
    return bool(mask[0].any() or mask[-1].any() or mask[:, 0].any() or mask[:, -1].any())
