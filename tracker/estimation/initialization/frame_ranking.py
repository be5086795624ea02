"""Rank frames by cheap evidence: how well the silhouettes agree, and how many show each person alone."""

from collections.abc import Callable, Sequence

import numpy as np

from tracker.errors import TrackerError
from tracker.estimation.initialization.own_figure import others_on_frame, own_figure
from tracker.estimation.initialization.silhouette_check import is_cut_off
from tracker.evidence.silhouettes import ViewSilhouette
from tracker.evidence.voxels.figure_masks import figure_masks
from tracker.evidence.voxels.visual_hull import carve_people
from tracker.session.session import Session


def ranked_frames(
    frames: Sequence[int], session: Session, person: int, silhouettes_on: Callable[[int], Sequence[ViewSilhouette]],
    size_m: float,
) -> list[int]:  # fmt: skip
    """Return frames, first those on which silhouettes agree in most views that show each person alone.

    Args:
        frames: to rank.
        session: with the poses of others, where figures are of them.
        person: index of a person who must have a figure.
        silhouettes_on: returns the silhouettes of all views by frame.
        size_m: edge of a voxel, metres.
    """

    def agreement(frame: int) -> float:
        silhouettes = silhouettes_on(frame)
        try:
            hull = carve_people(silhouettes, size_m)
            own_figure(session, person, hull, others_on_frame(session, person, frame, {}))
        except TrackerError:
            return 0.0
        coverages, figures, shown = np.nan_to_num(hull.coverages), hull.figures[: len(session.people)], list[float]()
        for figure in figures:
            masks = figure_masks(silhouettes, figure, [f for f in figures if f is not figure])
            alone = np.array([m.shows_figure_alone and not is_cut_off(m.mask) for m in masks])
            shown.append(float(coverages @ alone))
        return min(shown)

    return sorted(frames, key=agreement, reverse=True)
