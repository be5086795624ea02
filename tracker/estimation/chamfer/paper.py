"""The tracker as GD96 describe it: its settings, and the body that it is for.

The paper leaves some choices open; docs/log/trackers.md lists them with what is chosen here.
"""

from functools import partial

import numpy as np

from tracker.body.motion.history import HISTORY_FRAMES
from tracker.body.motion.pose_steps import PredictSettings
from tracker.estimation.chamfer.constants import PAPER_BODY
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.search.best_first import SearchSettings
from tracker.estimation.tracking.tracker import require_body
from tracker.evidence.view_evidence import EdgeSettings
from tracker.geometry.shapes import TaperedSuperquadric


def paper_settings() -> TrackSettings:
    """Return the settings of GD96: prediction by a parabola, best-first search in one pass, rejected outliers.

    Segments have any length (Fig. 6), and edges any direction. They are found in whole images, or in the foreground
    where masks or a background exist. Nothing refines, recovers or tracks backward.
    """
    return TrackSettings(
        estimate="search",
        predict=PredictSettings(order=2, window=HISTORY_FRAMES, full_window=True),
        # The paper states no end of a stage: none ends for want of improvement.
        search=SearchSettings(passes=(1.0,), patience=SearchSettings.max_expansions),
        recover=None,
        outliers="paper",
        edges=EdgeSettings(whole_images=True, static=False, max_segment_px=None, max_angle_rad=float(np.pi / 2)),
        whole_run=False,
    )


require_paper_body = partial(require_body, PAPER_BODY, TaperedSuperquadric)
"""Raises a TrackerError where people, by name, have another body than that of GD96, of any sizes. The decomposition of
the search space is part of the body, and a session shows poses of one set of degrees of freedom."""
