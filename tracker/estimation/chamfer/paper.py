"""The tracker as GD96 describe it: its settings, and the body that it is for.

The paper leaves some choices open; docs/trackers.md lists them with what is chosen here.
"""

from collections.abc import Mapping
from functools import cache

import numpy as np

from tracker.body.model import BodyModel
from tracker.body.motion.prediction import PredictSettings
from tracker.errors import Remedy, TrackerError
from tracker.estimation.chamfer.constants import PAPER_BODY
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.search.best_first import SearchSettings
from tracker.estimation.tracking.person_memory import HISTORY_FRAMES
from tracker.evidence.view_evidence import EdgeSettings
from tracker.formats.model_toml import load_model
from tracker.geometry.shapes import TaperedSuperquadric

_EXPANSIONS = 60
"""Expansions of a stage. The paper states no end of the search; this one ends for no other reason."""


def paper_settings() -> TrackSettings:
    """Return the settings of GD96: prediction by a parabola, best-first search in one pass, rejected outliers.

    Segments have any length (Fig. 6), and edges any direction. They are found in whole images, or in the foreground
    where masks or a background exist. Nothing refines, recovers or tracks backward.
    """
    return TrackSettings(
        estimate="search",
        predict=PredictSettings(order=2, window=HISTORY_FRAMES, full_window=True),
        search=SearchSettings(passes=(1.0,), patience=_EXPANSIONS, max_expansions=_EXPANSIONS),
        recover=None,
        outliers="paper",
        edges=EdgeSettings(whole_images=True, static=False, max_segment_px=None, max_angle_rad=float(np.pi / 2)),
        whole_run=False,
    )


def require_paper_body(bodies: Mapping[str, BodyModel]) -> None:
    """Check that people have the body of GD96, of any sizes.

    The decomposition of the search space is part of the body. A pose of another body is not converted: a session shows
    poses of one set of degrees of freedom.

    Args:
        bodies: by name of the person.

    Raises:
        TrackerError: a person has another body.
    """
    for name, body in bodies.items():
        if body.dof_names != _paper_dofs() or not all(isinstance(s, TaperedSuperquadric) for s in body.shapes):
            raise TrackerError(
                f"expected the paper's body {PAPER_BODY} of '{name}', found {body.name} of {body.n_dofs} degrees of "
                "freedom",
                Remedy("paper_body", body=PAPER_BODY),
            )


@cache
def _paper_dofs() -> tuple[str, ...]:
    """Return the names of the degrees of freedom of the paper's body."""
    return load_model(PAPER_BODY, 1.0).dof_names
