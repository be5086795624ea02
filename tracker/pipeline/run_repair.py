"""Repair the poses of a finished run before they get a status: search limbs where the colours of the run contradict.

A tracker searches the limbs that seem lost on one frame. The whole run shows more: how much likelier the colours under
a limb are than those of the place (`tracker/appearance/region_model.py`), and where tracks without a view have the
limb. Both propose where a limb may be, and so do the frames around. The frames with the largest contradiction are
searched first. A limb that is found is tried on the frames before and after, so that few searches repair a stretch.
"""

from bisect import bisect
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from heapq import heapify, heappop, heappush
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.appearance.part_colors import Colors, PartColors
from tracker.appearance.region_deficit import elsewhere_nats, worst_parts, worst_views
from tracker.appearance.region_learning import LearningFrame, learn_regions, learning_frames
from tracker.appearance.region_model import RegionFrame, RegionModel
from tracker.body.limbs import Limb, display_name, limbs
from tracker.body.model import PosedBody
from tracker.body.searches import Search
from tracker.evidence.observer import Observer
from tracker.evidence.view_evidence import EdgeSettings, ViewEvidence
from tracker.fitting.hypothesis import CLEAR_NATS, SAME_POSE_M, Hypothesis, distance_m, limbs_elsewhere
from tracker.geometry.arrays import Array, IntArray
from tracker.tracking.estimation.frame_problem import Bodies, with_body
from tracker.tracking.estimation.limb_repair import (
    MIN_GAIN_NATS,
    FrameEvidence,
    Repair,
    better_limbs,
    limbs_to_search,
)
from tracker.tracking.estimation.pose_paths import select_alternatives
from tracker.tracking.estimation.pose_score import common_evidence
from tracker.tracking.estimation.settings import EstimationSettings
from tracker.tracking.subjects import Subjects
from tracker.tracking.view_regions import regions
from tracker.tracking.view_tracks import FrameTracks

_MAX_TRIES = 3
"""Times that the appearance is learnt, again only from poses that were repaired, and that a frame is examined in
between: once by itself, and again where a limb beside it was found. After twice as many searches in a row that found
nothing the other frames are not searched: their contradictions are smaller."""


class RepairedPose(NamedTuple):
    """The pose of a person on a frame, compared with the evidence of the whole run."""

    pose: Array
    """(n_values,)."""
    trust: NDArray[np.bool_]
    """Whether the limbs of each track may be where that track has them, (n_tracks, n_limbs)."""
    elsewhere: Array
    """How much likelier each limb is elsewhere by the colours of the run, (n_limbs,), nats; see `elsewhere_nats`."""
    against: tuple[str, ...] = ()
    """For each limb, the part and the view that speak most against it, for people to read."""
    trace: tuple[Search, ...] = ()
    """The searches of the repair: those that were taken, and the last one."""
    alternatives: tuple[Hypothesis, ...] = ()
    """Other poses with a limb elsewhere that are about as good by contours and colours together, or better where the
    pose stays. Their costs are relative to that of the pose, nats."""
    searched: tuple[str, ...] = ()
    """Names of the limbs for which a search has proposed places all over, and has left them where they are."""
    refined: Array | None = None
    """Pose to which the contours of the frame pull it, (n_values,); None where it was not examined. Keyframes are."""


class RepairStep(NamedTuple):
    """Progress of the repair, and its result at the end."""

    done: int
    """Frames so far."""
    total: int
    found: Mapping[int, Mapping[int, RepairedPose]] | None = None
    """By person and frame; None before the end."""


class RunRepair:
    """Compares the poses of a run with the evidence of the whole run, and repairs them."""

    def __init__(
        self, observer: Observer, subjects: Subjects, settings: EstimationSettings, bodies: Mapping[int, Bodies],
        tracks: Mapping[int, Mapping[int, FrameTracks]],
        alternatives: Mapping[tuple[int, int], Sequence[Array]] | None = None, replaces: bool = True,
    ) -> None:  # fmt: skip
        """Prepare; nothing is computed yet.

        Args:
            observer: of the cameras that were tracked with.
            subjects: of the run. Keyframes stay.
            settings: of the tracker.
            bodies: all people by frame, in the poses that are compared.
            tracks: by person and frame, their poses by tracks without a view each.
            alternatives: other poses that the tracker found about as good, by frame and person, (n_values,) each.
            replaces: whether better poses take the place of those that are compared; else all stay.
        """
        self._alternatives = alternatives or {}
        self._replaces = replaces
        self._observer, self._subjects, self._settings = observer, subjects, settings
        self._bodies, self._tracks = dict(bodies), tracks
        self._learning: dict[int, tuple[ViewEvidence, ...]] = {}
        self._frames = sorted(bodies)
        self._first = np.cumsum([0, *(len(limbs(m)) for m in subjects.models)])
        self._found: dict[tuple[int, int], Repair] = {}
        self._traces: dict[tuple[int, int], tuple[Search, ...]] = {}
        self._searched: dict[tuple[int, int], tuple[str, ...]] = {}

    def steps(self) -> Iterator[RepairStep]:
        """Do the work. A caller that stops asking leaves it undone."""
        n, first, changed = len(self._frames), 0, self._frames
        while True:
            self._observe(changed)
            known, scores, before = self._learn(), dict[int, Array](), dict(self._bodies)
            for k in self._frames:
                scores[k] = known.score(self._regions(known, k), self._bodies[k]).nats
                yield RepairStep(first + len(scores), first + 2 * n)
            for done in self._repair(known, self._elsewhere(scores)[0]):
                yield RepairStep(first + n + min(done, n), first + 2 * n)
            self._select_alternatives()
            changed = [k for k in self._frames if self._bodies[k] is not before[k]]
            if not changed or first == 2 * n * (_MAX_TRIES - 1):
                break
            first += 2 * n
        self._observe(changed)
        for k in changed:
            scores[k] = known.score(self._regions(known, k), self._bodies[k]).nats
        yield RepairStep(first + 2 * n, first + 2 * n, self._results(scores))

    def _colors_at(self, frame: int) -> tuple[ViewEvidence, ...]:
        cameras = self._observer.working_cameras
        where = regions(cameras, self._bodies[frame])
        return self._observer.evidence(frame, where, edges=EdgeSettings(foreground=False))

    def _observe(self, changed: Sequence[int]) -> None:
        """Compute the evidence of frames to learn from, where the poses have changed."""
        for k in learning_frames(self._frames):
            if k in changed:
                self._learning[k] = self._colors_at(k)

    def _learn(self) -> RegionModel:
        frames = [LearningFrame(views, self._bodies[k]) for k, views in self._learning.items()]
        return learn_regions(frames, self._observer.working_cameras, self._observer.empty_scenes())

    def _regions(self, known: RegionModel, frame: int) -> RegionFrame:
        return known.frame(self._learning.get(frame) or self._colors_at(frame), self._bodies[frame])

    def _elsewhere(self, scores: Mapping[int, Array]) -> tuple[dict[int, Array], IntArray]:
        """Return how much likelier each limb of all people is elsewhere on each frame, (n_limbs,), nats, and the part
        of each that says so, (T, n_limbs)."""
        models = self._subjects.models
        found = elsewhere_nats(np.array([scores[k].sum(axis=0) for k in self._frames]), models)
        parts = worst_parts(found, models)
        return dict(zip(self._frames, np.take_along_axis(found, parts, axis=1), strict=True)), parts

    def _against(self, scores: Mapping[int, Array], parts: IntArray) -> dict[int, list[str]]:
        """Return the part and the view that speak most against each limb of all people on each frame."""
        models, nats = self._subjects.models, np.array([scores[k] for k in self._frames])
        views = np.take_along_axis(worst_views(nats, models), parts, axis=1)
        names = [display_name(p.name) for m in models for p in m.parts]
        cameras = [c.camera.name for c in self._observer.cameras]
        return {
            k: [f"{names[p]} elsewhere in {cameras[v]}" for p, v in zip(*of_frame, strict=True)]
            for k, *of_frame in zip(self._frames, parts, views, strict=True)
        }

    def _of_person(self, of_limbs: Array, person: int) -> Array:
        return of_limbs[self._first[person] : self._first[person + 1]]

    def _repair(self, known: RegionModel, elsewhere: Mapping[int, Array]) -> Iterator[int]:
        """Examine all frames, the one with the largest contradiction first. Yields how many are done."""
        everybody = ((k, i) for k in self._frames for i in self._subjects.tracked)
        due = [(-float(self._of_person(elsewhere[k], i).max()), k, i) for k, i in everybody]
        heapify(due)
        colors, failures, visits = self._part_colors(), 0, Counter[tuple[int, int]]()
        while due:
            _, k, i = heappop(due)
            visits[k, i] += 1
            # Once each, as long as searches find something.
            is_searched = visits[k, i] == 1 and failures < 2 * _MAX_TRIES
            search = limbs_to_search(self._subjects.models[i], self._of_person(elsewhere[k], i)) if is_searched else []
            others = self._other_poses(k, i)
            apart = self._apart(k, i, others)
            if search or apart or i in self._subjects.keyframes_at(k):
                is_better = self._examine(known, colors[i], k, i, others, apart, search)
                if search:
                    failures = 0 if is_better else failures + 1
                if is_better and i in self._free(k):
                    around = [n for n in self._around(k) if i in self._free(n) and visits[n, i] < _MAX_TRIES]
                    for n in around:
                        heappush(due, (-np.inf, n, i))
            yield len(visits)

    def _free(self, frame: int) -> list[int]:
        """Return the tracked people whose pose on a frame may be replaced: who have no keyframe there."""
        if not self._replaces:
            return []
        return [i for i in self._subjects.tracked if i not in self._subjects.keyframes_at(frame)]

    def _around(self, frame: int) -> list[int]:
        """Return the frames before and after one."""
        place = bisect(self._frames, frame)
        return [*self._frames[max(0, place - 2) : place - 1], *self._frames[place : place + 1]]

    def _part_colors(self) -> list[PartColors | None]:
        """Return the colours of each person's parts on the first frame. They rank proposals."""
        bodies = self._bodies[self._frames[0]]
        views = self._observer.evidence(self._frames[0], regions(self._observer.working_cameras, bodies))
        return [Colors(views, bodies, i).learn() for i in range(len(bodies))]

    def _other_poses(self, frame: int, person: int) -> list[Array]:
        """Return the poses of a person by the tracks and searches, and on the frames around."""
        tracks = self._tracks[person].get(frame)
        return [
            *([] if tracks is None else tracks.poses),
            *self._alternatives.get((frame, person), ()),
            *(self._bodies[k][person].values for k in self._around(frame)),
        ]

    def _apart(self, frame: int, person: int, others: Sequence[Array]) -> list[Limb]:
        """Return the limbs of several parts that lie elsewhere in another pose."""
        own = self._bodies[frame][person]
        names = {n for pose in others for n in limbs_elsewhere(own, PosedBody(own.model, pose))}
        return [x for x in limbs(own.model) if x.name in names and len(x.parts) > 1]

    def _examine(
        self, known: RegionModel, colors: PartColors | None, frame: int, person: int, others: Sequence[Array],
        apart: Sequence[Limb], search: Sequence[Limb],
    ) -> bool:  # fmt: skip
        """Compare the pose of a person on a frame with others; return whether another is better.

        It takes the place of the pose if that is free.
        """
        bodies = self._bodies[frame]
        model = bodies[person].model
        guesses = [bodies, *(with_body(bodies, person, PosedBody(model, pose)) for pose in others)]
        views = common_evidence(self._observer, frame, guesses, self._settings)
        evidence = FrameEvidence(views, known, known.frame(views, bodies), colors, self._subjects.active_dofs[person])
        found = better_limbs(evidence, bodies, person, self._settings, search, others, apart)
        if is_staying := person not in self._free(frame):
            found = found.staying(bodies[person])
        self._found[frame, person] = found
        taken = (entry for entry in self._traces.get((frame, person), ()) if entry.taken)
        self._traces[frame, person] = (*taken, found.entry)
        if search or found.is_better:
            self._searched[frame, person] = tuple(limb.name for limb in search)
        if found.is_better and not is_staying:
            self._bodies[frame] = with_body(bodies, person, PosedBody(model, found.pose))
        return found.is_better

    def _select_alternatives(self) -> None:
        """Select the cheapest path through the alternatives of consecutive frames that each gain too little alone."""
        for i in self._subjects.tracked:
            frames = [self._candidates(k, i) for k in self._frames]
            selected = select_alternatives(frames, MIN_GAIN_NATS)
            for k, found, chosen in zip(self._frames, frames, selected, strict=True):
                if chosen:
                    best, *others = found[chosen], *found[:chosen], *found[chosen + 1 :]
                    self._bodies[k] = with_body(self._bodies[k], i, best.body)
                    likely = tuple(h for h in others if h.cost < best.cost + CLEAR_NATS)
                    self._found[k, i] = self._found[k, i]._replace(pose=best.pose, cost=best.cost, alternatives=likely)
                    *before, last = self._traces[k, i]
                    self._traces[k, i] = (*before, last._replace(after_nats=round(best.cost, 1), taken=True))

    def _candidates(self, frame: int, person: int) -> list[Hypothesis]:
        """Return the pose of a person on a frame, and the alternatives that are elsewhere or cheaper if it is free."""
        body, examined = self._bodies[frame][person], self._found.get((frame, person))
        if examined is None or person not in self._free(frame):
            return [Hypothesis(body)]
        cost = examined.cost
        others = (h for h in examined.alternatives if h.cost < cost or distance_m(h.body, body) > SAME_POSE_M)
        return [Hypothesis(body, "repair", cost), *others]

    def _results(self, scores: Mapping[int, Array]) -> dict[int, dict[int, RepairedPose]]:
        elsewhere, parts = self._elsewhere(scores)
        against = self._against(scores, parts)
        out: dict[int, dict[int, RepairedPose]] = {i: {} for i in self._tracks}
        for i, of_person in self._tracks.items():
            own = slice(self._first[i], self._first[i + 1])
            for k, tracks in of_person.items():
                examined = self._found.get((k, i))
                refined = None if examined is None else examined.refined
                trust, pose = self._trusted(k, i, tracks), self._bodies[k][i].values
                trace, searched = self._traces.get((k, i), ()), self._searched.get((k, i), ())
                known = elsewhere[k][own], tuple(against[k][own]), trace, self._rivals(k, i), searched
                out[i][k] = RepairedPose(pose, trust, *known, refined)
        return out

    def _rivals(self, frame: int, person: int) -> tuple[Hypothesis, ...]:
        """Return the poses of a person that are at least about as good as the one on a frame, with a limb elsewhere."""
        body, examined = self._bodies[frame][person], self._found.get((frame, person))
        others = () if examined is None else (replace(h, cost=h.cost - examined.cost) for h in examined.alternatives)
        return tuple(h for h in others if h.cost < CLEAR_NATS and distance_m(h.body, body) > SAME_POSE_M)

    def _trusted(self, frame: int, person: int, tracks: FrameTracks) -> NDArray[np.bool_]:
        """Return where the tracks may have the limbs: where the pose has them, or one that is about as good."""
        model, examined = self._subjects.models[person], self._found.get((frame, person))
        trust = np.ones((len(tracks.poses), len(limbs(model))), np.bool_)
        if examined is None:
            return trust
        likely = [self._bodies[frame][person], *(h.body for h in examined.alternatives)]
        for row, pose in zip(trust, tracks.poses, strict=True):
            body = PosedBody(model, pose)
            for j, limb in enumerate(limbs(model)):
                on_limb = np.isin(model.point_parts, limb.parts)
                gaps = [np.linalg.norm((x.points_world - body.points_world)[on_limb], axis=1).max() for x in likely]
                row[j] = min(gaps) <= SAME_POSE_M
        return trust
