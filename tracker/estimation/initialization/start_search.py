"""Search around a fitted start: its limbs, exchanged limbs, and the directions that contours hardly determine.

A start from voxels or silhouettes is several degrees off in each joint, and often a limb is elsewhere. A fit then ends
in the local minimum next to it. Its cost and status look as good as those of the right pose.
"""

from collections.abc import Sequence

from tracker.body.model import PosedBody
from tracker.estimation.by_frame.frame_problem import FrameProblem, PersonPrior
from tracker.estimation.by_frame.settings import EstimationSettings
from tracker.estimation.by_frame.start_pose import MAX_ROUNDS, roughly_known, search_start
from tracker.estimation.fitting.hypothesis import SAME_POSE_M, distance_m
from tracker.estimation.tracking.person_memory import PersonMemory
from tracker.estimation.tracking.view_regions import read_views
from tracker.evidence.observer import Observer

_N_DRAWS = 3
"""Draws of samples in each round."""


def search_around(
    observer: Observer, bodies: Sequence[PosedBody], frame: int, settings: EstimationSettings
) -> PosedBody:
    """Search around the start of the first person on a frame, and return the person in the cheapest pose.

    Args:
        observer: of the recording.
        bodies: all people; the others stay.
        frame: of the start.
        settings: of the tracker.
    """
    body, *others = bodies
    wide = roughly_known(settings)
    for _ in range(MAX_ROUNDS):
        everybody = (body, *others)
        priors = [PersonPrior(b.model, b.values) for b in everybody]
        problem = FrameProblem(read_views(observer, frame, everybody), priors, wide)
        memory = PersonMemory(body.model, body.values)
        before, (body, _) = body, search_start(problem, 0, everybody, memory, _N_DRAWS)
        if distance_m(before, body) < SAME_POSE_M:
            break
    return body
