"""Estimate the poses of all frames of a run together: propose, search the likeliest path, solve it, weigh what is left.

Every source only proposes poses: the passes forward and backward, alternatives, stored poses, frames beside. One
likelihood compares them (`frame_hypotheses`), one path goes through all frames (`path_search`), and one least-squares
problem moves its poses (`tracker.estimation.trajectory.solve`). The hypotheses that are left say how sure each limb is
(`path_assessment`).

Colours are learnt from the poses of the run: a person who faces the wrong way in all of them wears those of the other
side. In a run that no keyframe begins, contours and key points, which do not depend on that, are asked first.
"""

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from tracker.body.model import PosedBody
from tracker.body.motion.pose_steps import moving_bodies
from tracker.compute.progress import mapped
from tracker.estimation.appearance.region_model import LearningFrame, RegionModel, learn_regions, learning_frames
from tracker.estimation.by_frame.frame_problem import Bodies, prediction_sigmas, with_body
from tracker.estimation.by_frame.pose_score import FrameEvidence, common_evidence, scorer_without_prediction
from tracker.estimation.by_frame.settings import OWN_TRUST, EstimationSettings
from tracker.estimation.fitting.hypothesis import CLEAR_NATS
from tracker.estimation.fitting.limb_exchange import turned_round
from tracker.estimation.runs.frame_hypotheses import FrameHypotheses, Proposal
from tracker.estimation.runs.path_assessment import DOUBTFUL_MASS, RunPose, assessed_path
from tracker.estimation.runs.path_search import PathSearch, other_sides
from tracker.estimation.search.chamfer_cost import frame_cost
from tracker.estimation.tracking.tracker import Subjects
from tracker.estimation.trajectory.solve import PosedPath, even_blocks, solve_path
from tracker.evidence.observer import Observer
from tracker.evidence.view_evidence import ViewEvidence, with_colors_only
from tracker.geometry.arrays import Array


@dataclass(frozen=True, eq=False)
class RunFrames:
    """The frames of a run, and what is known of the poses there."""

    observer: Observer
    subjects: Subjects
    """People, keyframes and locked degrees of freedom."""
    settings: EstimationSettings
    fps: float
    """Frame rate of the recording, 1/s."""
    poses: Mapping[int, Sequence[Array]]
    """First guesses of the poses of all people by frame, (n_values,) each."""
    proposals: Mapping[tuple[int, int], Sequence[Proposal]] = field(default_factory=dict)
    """Other poses by frame and person."""
    around: Mapping[int, Sequence[Array]] = field(default_factory=dict)
    """Poses of all people on frames beside these, which stay and show the motion there."""
    stays: bool = False
    """Whether the first guesses are assessed, and stay; else the estimate takes their place."""


def poses_beside(frame: int, step: int, poses_on: Callable[[int], Sequence[Array | None]]) -> dict[int, list[Array]]:
    """Return the poses of all people on the two frames beside one, as far as all have some; see `RunFrames.around`.

    Args:
        frame: the first or last frame of a run.
        step: to the next frame beside it.
        poses_on: returns the pose of each person on a frame; None without one.
    """
    out = dict[int, list[Array]]()
    for k in (frame + step, frame + 2 * step):
        poses = poses_on(k)
        known = [pose for pose in poses if pose is not None]
        if len(known) < len(poses):
            break
        out[k] = known
    return out


class Progress(NamedTuple):
    """How much of the work is done."""

    done: int
    total: int


def estimate_run(run: RunFrames) -> Generator[Progress, None, dict[int, dict[int, RunPose]]]:
    """Estimate the poses of all tracked people on all frames.

    Keyframes stay, and so do locked degrees of freedom. A caller that stops asking leaves the work undone.

    Returns:
        The poses by person and frame. Keyframes are as they were, and assessed like others.
    """
    return (yield from _RunEstimate(run).steps())


class _RunEstimate:
    """The state of the work."""

    def __init__(self, run: RunFrames) -> None:
        """Begin with the first guesses."""
        self._poses = {k: [*poses] for k, poses in {**run.around, **run.poses}.items()}  # the best so far
        self._run, self._frames = run, sorted(self._poses)
        self._places = {k: i for i, k in enumerate(self._frames)}
        self._views: dict[int, tuple[ViewEvidence, ...]] = {}
        self._found: dict[int, dict[int, RunPose]] = {i: {} for i in run.subjects.tracked}
        self._facing = dict.fromkeys(run.subjects.tracked, KNOWN)
        self._colors: RegionModel | None = None
        seen = run.observer, run.observer.origin
        self._timed = {k for k in self._frames if any(t for observer in seen for t in observer.ahead_frames(k))}

    def steps(self) -> Generator[Progress, None, dict[int, dict[int, RunPose]]]:
        """Do the work, block by block."""
        blocks, people = even_blocks(len(self._frames)), self._run.subjects.tracked
        n_turns = max(1, self._run.settings.rounds) if len(people) > 1 else 1
        # For the time left, in that of a person's proposals: evidence around all proposals; proposals and path of each
        # person; evidence of the whole pictures for the cost. Sweeps are quick.
        per_frame = 2 + 2 * len(people) + 2
        total, first = per_frame * sum(used.stop - used.start for _, used in blocks), 0
        for own, used in blocks:
            for done in self._block(self._frames[own], self._frames[used], n_turns):
                yield Progress(first + done, total)
            first += per_frame * (used.stop - used.start)
        return self._found

    def _block(self, own: Sequence[int], used: Sequence[int], n_turns: int) -> Generator[int, None, None]:
        """Estimate the poses of some frames by those and others around; yield how much is done."""
        people, n = self._run.subjects.tracked, len(used)
        self._views = {k: self._views[k] for k in used if k in self._views}
        proposals = {(k, i): self._proposals(k, i) for k in used for i in people}
        for done, k in enumerate(used):
            if k not in self._views:
                self._views[k] = self._observe(k, [(i, p.pose) for i in people for p in proposals[k, i]])
            yield 2 * done
        colors = self._colors = self._colors or self._learn_colors()
        evidence = {k: self._evidence(k, colors) for k in used}
        done, searches = 2 * n, dict[int, PathSearch]()
        for turn in range(n_turns):
            for i in people:
                frames = list[FrameHypotheses]()
                for t, k in enumerate(used):
                    if turn:
                        frames.append(searches[i].frames[t].among(self._bodies(k)))
                    else:
                        frames.append(self._proposed(evidence[k], k, i, proposals[k, i]))
                        yield done + t
                done += n if turn == 0 else 0
                if turn and frames == searches[i].frames:  # nobody else has moved: the search would repeat itself
                    continue
                searches[i] = PathSearch(frames, self._times_s(used))
                for _ in searches[i].rounds():
                    yield done
                self._take(used, i, searches[i].poses)
        assessed = dict[int, list[RunPose]]()
        for i in people:
            assessed[i] = yield from self._solve(used, i, searches[i], done)
            done += n
        for t, k in enumerate(used):
            yield done + 2 * t
            if k in own and k in self._run.poses:
                cost = frame_cost(self._run.observer.origin.evidence(k), self._bodies(k))
                known = {"cost_px": cost.total_px, "view_costs_px": tuple(map(float, cost.view_costs_px))}
                for i in people:
                    self._found[i][k] = assessed[i][t]._replace(is_facing_sure=self._facing[i].is_sure, **known)

    def _proposals(self, frame: int, person: int) -> list[Proposal]:
        """Return poses of a person on a frame by all that is known."""
        run, here, place = self._run, self._poses[frame][person], self._places[frame]
        model = run.subjects.models[person]
        beside = [self._frames[i] for i in (place - 1, place + 1) if 0 <= i < len(self._frames)]
        return [
            Proposal(here, "forward"), *run.proposals.get((frame, person), ()),
            *(Proposal(self._poses[k][person], "neighbour") for k in beside), *other_sides(PosedBody(model, here)),
        ]  # fmt: skip

    def _proposed(
        self, evidence: FrameEvidence, frame: int, person: int, proposals: Sequence[Proposal]
    ) -> FrameHypotheses:
        """Return a person on a frame with hypotheses."""
        subjects = self._run.subjects
        out = FrameHypotheses(evidence, self._bodies(frame), person, self._run.settings, subjects.active_dofs[person])
        stays = frame not in self._run.poses
        if person in subjects.keyframes_at(frame) or stays:
            out.anchored(subjects.keyframes_at(frame).get(person, self._poses[frame][person]))
        if not stays:
            out.propose(proposals)
        return out

    def _bodies(self, frame: int) -> Bodies:
        """Return all people on a frame, with their velocities where views need them."""
        models = self._run.subjects.models
        if frame in self._timed:
            return moving_bodies(models, self._poses, frame)
        return tuple(map(PosedBody, models, self._poses[frame]))

    def _observe(self, frame: int, proposals: Sequence[tuple[int, Array]] = ()) -> tuple[ViewEvidence, ...]:
        """Return the evidence of a frame around all people, and around proposals, (n_values,) each, of some of them."""
        here = self._bodies(frame)
        others = (with_body(here, i, PosedBody(here[i].model, pose, here[i].velocity)) for i, pose in proposals)
        return common_evidence(self._run.observer, frame, [here, *others], self._run.settings)

    def _evidence(self, frame: int, colors: RegionModel) -> FrameEvidence:
        views = self._views[frame]
        return FrameEvidence(views, colors, colors.frame(views, self._bodies(frame)))

    def _learn_colors(self) -> RegionModel:
        """Return the appearance of the people and places of the run, by people who face the way that contours say."""
        observer, at = self._run.observer, learning_frames(self._frames)
        nats, seen = {i: list[float]() for i in self._found if self._is_free(i)}, list[tuple[ViewEvidence, ...]]()
        for k in at:
            views = self._views.get(k) or self._observe(k)
            for i, of_person in nats.items():
                of_person.append(turning_nats(views, self._bodies(k), i, self._run.settings))
            seen.append(tuple(map(with_colors_only, views)))
        self._facing |= {i: Facing.of(of_person) for i, of_person in nats.items()}
        for i in (i for i, facing in self._facing.items() if facing.is_turned):
            turned = [turned_round(self._bodies(k)[i]) for k in self._frames]
            self._take(self._frames, i, np.array(turned))
        frames = [LearningFrame(views, self._bodies(k)) for k, views in zip(at, seen, strict=True)]
        return learn_regions(frames, observer.working_cameras, observer.empty_scenes())

    def _is_free(self, person: int) -> bool:
        """Return whether nothing says which way a person faces: neither a keyframe nor a pose beside the run."""
        return not self._run.around and not any(person in own for own in self._run.subjects.keyframes.values())

    def _solve(
        self, used: Sequence[int], person: int, search: PathSearch, done: int
    ) -> Generator[int, None, list[RunPose]]:
        """Solve the path of a person, and weigh what else it may be; yield how much is done."""
        poses, frames, first = search.poses, search.frames, [self._first(k)[person] for k in used]
        path = PosedPath(
            search.model, self._times_s(used), poses, lambda t: frames[t].blocks(poses[t]),
            np.array([f.anchor is not None for f in frames]), self._run.subjects.active_dofs[person],
        )  # fmt: skip
        solved = yield from mapped(solve_path(path), lambda read: done + read)
        poses = np.array(first) if self._run.stays else solved.poses
        self._take(used, person, poses)
        return assessed_path(search, solved, first, poses, [c.camera.name for c in self._run.observer.cameras])

    def _first(self, frame: int) -> Sequence[Array]:
        """Return the first guesses of a frame, or its poses that stay."""
        return self._run.poses[frame] if frame in self._run.poses else self._run.around[frame]

    def _take(self, frames: Sequence[int], person: int, poses: Array) -> None:
        for k, pose in zip(frames, poses, strict=True):
            self._poses[k][person] = pose

    def _times_s(self, frames: Sequence[int]) -> Array:
        return np.array(frames) / self._run.fps


def turning_nats(views: Sequence[ViewEvidence], bodies: Bodies, person: int, settings: EstimationSettings) -> float:
    """Return how much dearer a pose is by contours and key points if the person faces the other way, nats.

    Args:
        views: evidence of a frame.
        bodies: all people on it.
        person: index of the person.
        settings: of the tracker.
    """
    body = bodies[person]
    scorer = scorer_without_prediction(views, bodies, person, settings)
    both = scorer.refined(
        body.model, [body.values, turned_round(body)], OWN_TRUST * prediction_sigmas(body.model, settings)
    )
    here, turned = scorer.costs_with_priors(body.model, both)
    return float(turned - here)


class Facing(NamedTuple):
    """The way that a person faces, by the frames of a run."""

    is_turned: bool
    """Whether the other way is likelier."""
    is_sure: bool
    """Whether nearly all frames clearly say that the person faces as in the first guesses."""

    @classmethod
    def of(cls, nats: Sequence[float]) -> "Facing":
        """Return it by some frames, each with its `turning_nats`. Frames near one another say the same: they are
        counted, not added up."""
        is_clear = np.array(nats) > CLEAR_NATS
        return cls(float(np.median(nats)) < 0, float(is_clear.mean()) > 1 - DOUBTFUL_MASS)


KNOWN = Facing(False, True)
"""That of a person with a keyframe."""
