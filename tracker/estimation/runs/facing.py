"""Which way a person faces in a run that no keyframe begins.

The colours of a run are learnt from its poses. A person who faces the wrong way in all of them wears those of the other
side, so that colours agree with whatever was found. Contours and key points do not depend on it.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.estimation.by_frame.frame_problem import Bodies, trust
from tracker.estimation.by_frame.pose_score import scorer_without_prediction
from tracker.estimation.by_frame.settings import OWN_TRUST, EstimationSettings
from tracker.estimation.fitting.hypothesis import CLEAR_NATS
from tracker.estimation.fitting.limb_exchange import turned_round
from tracker.estimation.runs.path_assessment import DOUBTFUL_MASS
from tracker.evidence.view_evidence import ViewEvidence


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
    both = scorer.refined(body.model, [body.values, turned_round(body)], OWN_TRUST * trust(body.model, settings))
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
