"""Find people automatically: first poses, then their sizes. Tracking goes on from there in both directions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from tracker.acquisition.from_contours import Acquisition, AcquisitionSettings
from tracker.body.model import BodyModel, PosedBody
from tracker.compute.progress import Report, part_of, unreported
from tracker.evidence.observer import Observer
from tracker.formats.model_toml import format_model
from tracker.geometry.arrays import Array
from tracker.initialization.first_pose import (
    ENOUGH_FRAMES,
    HEIGHT_SIGMA,
    FirstPose,
    FirstPoses,
    Show,
    find_first_poses_anywhere,
)  # fmt: skip
from tracker.pipeline.body_acquisition import SIZES_EDITS, PosedFrames, acquire_body, with_sizes_changed
from tracker.posing.retarget import retarget_pose
from tracker.session.session import Session, save_model
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import PoseChange, PoseRecord

_FRAMES = 12
"""Largest number of frames on which first poses are looked for."""
_STARTING = 0.5
"""Share of the work up to the end of the first poses, where sizes are acquired too."""

AXES = "silhouette_axes"
"""Setting of the session: the `frame` on which people were found, and the `lines` of the silhouettes' axes by camera.
For each person these are the successive approximations, as ends x, y in undistorted px (GD96 Fig. 5)."""


@dataclass(frozen=True)
class FindSettings:
    """Settings of the search for people."""

    frame: int | None = None
    """First frame to try; None for the middle of the recording first, where people are seen from all sides."""
    acquire: bool = True
    """Whether the sizes of the bodies are acquired from the contours."""
    acquisition: AcquisitionSettings = field(default_factory=lambda: AcquisitionSettings(rounds=2))


class FoundPeople(NamedTuple):
    """People who were found."""

    first: FirstPoses
    bodies: Mapping[int, BodyModel]
    """By index of the person."""
    poses: Mapping[int, Array]
    """The first pose of each in that body, (n_values,)."""
    acquired: Mapping[int, Acquisition]
    """The acquisitions whose bodies fit the contours better than those before."""

    @property
    def frame(self) -> int:
        """Frame of the first poses."""
        return self.first.frame


def frames_to_try(frames: Sequence[int], first: int | None) -> list[int]:
    """Return frames spread evenly, each new one as far as possible from those before.

    Args:
        frames: that may be tried, ascending.
        first: frame to try first; None for the middle one.
    """
    begin = frames[len(frames) // 2] if first is None else first
    # Midpoints of equal parts: on the first and last frame a start is tracked in one direction only.
    n = min(_FRAMES, len(frames))
    indices = ((np.arange(n) + 0.5) * len(frames) / n).astype(int)
    spread = sorted({frames[i] for i in indices} - {begin})
    order = [begin]
    while spread:
        farthest = max(spread, key=lambda k: min(abs(k - other) for other in order))
        spread.remove(farthest)
        order.append(farthest)
    return order[:_FRAMES]


def expected_steps(n_frames: int, done: int, good: int) -> int:
    """Return how many trials of frames there will have been tried if all that follow are good.

    Args:
        n_frames: frames that may be tried.
        done: number of them so far.
        good: number of them that gave good first poses.
    """
    return max(done, min(n_frames, done + max(0, ENOUGH_FRAMES - good)))


def find_people(
    session: Session, observer: Observer, people: Sequence[int], frames: Sequence[int], settings: FindSettings,
    report: Report = unreported, show: Show = lambda frame, found: None,
) -> FoundPeople:  # fmt: skip
    """Find the first poses of people, all on one frame, and their sizes. Nothing is stored; see `store_found`.

    Args:
        session: the session.
        observer: of its recording.
        people: indices of the people to find.
        frames: the frames that may be used.
        settings: of the search.
        report: shows progress.
        show: shows each frame that is tried and the first poses on it.

    Raises:
        TrackerError: no frame shows the people well enough.
    """
    tried = frames_to_try(frames, settings.frame)
    end, done, good, share = _STARTING if settings.acquire else 1.0, 0, 0, 0.0

    def count(frame: int, found: FirstPoses | None) -> None:
        nonlocal good
        good += found is not None and found.is_good
        show(frame, found)

    def say(text: str) -> None:
        nonlocal done, share
        done += 1
        share = max(share, min(0.95, done / expected_steps(len(tried), done, good)))
        report("finding first poses", end * share, text)

    def go_on() -> None:
        report("finding first poses", end * share, "")

    go_on()
    first = find_first_poses_anywhere(session, observer, people, tried, say=say, show=count, step=go_on)
    bodies = {i: p.model for i, p in first.poses.items()}
    poses = {i: p.start.pose for i, p in first.poses.items()}
    acquired: dict[int, Acquisition] = {}
    whole = range(frames[0], frames[-1] + 1)
    for number, person in enumerate(people if settings.acquire else ()):
        begin, size = end + (1 - end) * number / len(people), (1 - end) / len(people)
        so_far = FoundPeople(first, bodies, poses, {})
        of_sizes = part_of(report, begin, begin + size, "acquiring sizes")
        found = _acquired(session, observer, person, whole, settings, so_far, of_sizes)
        if found.cost_after_px < found.cost_before_px:
            acquired[person] = found
            poses[person] = retarget_pose(poses[person], bodies[person], found.body)
            bodies[person] = found.body
    report("done", 1.0, "")
    return FoundPeople(first, bodies, poses, acquired)


def _acquired(
    session: Session, observer: Observer, person: int, frames: Sequence[int], settings: FindSettings,
    found: FoundPeople, report: Report,
) -> Acquisition:  # fmt: skip
    """Acquire the sizes of one person from frames that are tracked from the first poses."""
    others = [i for i in found.bodies if i != person]
    on_frame = tuple(PosedBody(found.bodies[i], found.poses[i]) for i in (person, *others))
    models = [found.bodies.get(i, p.model) for i, p in enumerate(session.people)]
    sized = replace(session, people=tuple(replace(p, model=m) for p, m in zip(session.people, models, strict=True)))
    known = PosedFrames({found.frame: on_frame}, {}, {})
    how = settings.acquisition
    if person in found.first.poses and found.first.poses[person].start.is_measured:
        how = replace(how, priors=replace(how.priors, height=min(HEIGHT_SIGMA, how.priors.height)))
    return acquire_body(sized, observer, person, frames, how, report, known)


def first_record(found: FoundPeople, person: int, revision: int) -> PoseRecord:
    """Return the stored form of the first pose of a person.

    Args:
        found: the people.
        person: index of the person.
        revision: of the person's body.
    """
    first: FirstPose = found.first.poses[person]
    pose = found.poses[person]
    settings: dict[str, Any] = {"method": first.start.source}
    return PoseRecord(
        pose, ("searched",) * len(pose), revision, status=first.status, settings=settings,
        remark="; ".join(first.notes),
    )  # fmt: skip


def axes_record(found: FoundPeople) -> dict[str, Any]:
    """Return the frame and the major axes of all silhouettes on it, as the setting `AXES` holds them."""
    lines: dict[str, list[Any]] = {}
    for first in found.first.poses.values():
        for name, own in first.lines_px.items():
            lines.setdefault(name, []).append(np.round(own, 1).tolist())
    return {"frame": found.frame, "lines": lines}


def store_found(session: Session, store: AnnotationStore, found: FoundPeople, label: str = "find people") -> Session:
    """Store the first poses and the bodies of people as one undoable edit; return the session with the bodies.

    Args:
        session: the session, which this process has locked.
        store: its annotations.
        found: the people.
        label: of the entry of the history.
    """
    sizes, changes = [], []
    for person, body in found.bodies.items():
        who = session.people[person]
        before = store.add_model_revision(who.name, format_model(who.model))
        if format_model(body) != format_model(who.model):
            session = save_model(session, person, body)
        revision = store.add_model_revision(who.name, format_model(body))
        changes.append(PoseChange(who.name, found.frame, first_record(found, person, revision)))
        if revision != before:
            sizes.append((who.name, before, revision))
    edit = store.commit(f"{label}, frame {found.frame}", changes).edit
    store.set_setting(AXES, axes_record(found))
    if sizes:
        store.set_setting(SIZES_EDITS, with_sizes_changed(store.setting(SIZES_EDITS, {}), edit, sizes))
    return session


def sentences(session: Session, found: FoundPeople) -> list[str]:
    """Return a sentence on each first pose, on its doubts, and on each acquired body."""
    out = []
    for person, first in found.first.poses.items():
        name = session.people[person].name
        out.append(
            f"{name}: started on frame {found.frame} by {first.start.source}, "
            f"{first.model.height_m:.2f} m tall, {first.status}, "
            f"cost {first.cost_px:.2f} px over a short track"
        )
        out += [f"{name}: {note}" for note in first.notes]
        if person in found.acquired:
            sizes = found.acquired[person]
            out.append(
                f"{name}: sizes acquired from {len(sizes.frames)} frames, {sizes.body.height_m:.2f} m tall, "
                f"cost {sizes.cost_before_px:.2f} px before, {sizes.cost_after_px:.2f} px after"
            )
    return out
