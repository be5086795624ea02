"""The sentence that a table of parts and views gives."""

from dataclasses import replace

import numpy as np
import pytest

from tracker.estimation.by_frame.part_evidence import PartTable, contradiction, with_colors_only
from tracker.formats.model_toml import load_model

MODEL = load_model("gavrila34")
PARTS = [p.name for p in MODEL.parts]
VIEWS = ("FRONT", "LEFT")
THETAS_PX = np.array([20.0, 20.0])
CALF = PARTS.index("left_calf")


def table(**cells):
    """An unobtrusive table, with cells by name, view and column."""
    n = len(PARTS)
    usual = PartTable(np.zeros((2, n)), np.zeros(n), *(np.full((2, n), x) for x in (0.05, 0.05, 2.0, 2.0)))
    for name, (at, value) in cells.items():
        getattr(usual, name)[at] = value
    return usual


def said(found):
    worst = contradiction(MODEL, found, THETAS_PX, VIEWS)
    return None if worst is None else (PARTS[worst.part], worst.view, worst.sentence)


def test_nothing_is_said_of_a_usual_pose():
    assert said(table()) is None
    assert said(table(below=((0, CALF), 5.9))) is None  # 400 to 1 contradict


@pytest.mark.parametrize(
    ("outside", "sentence"),
    [
        (0.8, "left calf: outside the person in LEFT"),
        (0.3, "left calf: 30% outside the person in LEFT"),
        (0.1, "left calf: its colours are not there in LEFT"),
        (np.nan, "left calf: its colours are not there in LEFT"),
    ],
)
def test_the_worst_cell_names_part_and_view(outside, sentence):
    found = table(below=((1, CALF), 9.0), outside=((1, CALF), outside))
    assert said(found) == ("left_calf", 1, sentence)


def test_a_part_that_usually_lies_outside_is_not_called_so():
    """A silhouette may lack it on all frames: trousers in the colour of the floor."""
    found = table(below=((1, CALF), 9.0), outside=((1, CALF), 0.8), usual_outside=((1, CALF), 0.75))
    assert said(found)[2] == "left calf: its colours are not there in LEFT"


def test_a_part_that_no_view_shows_is_missed_in_all():
    hidden = table(below=((slice(None), CALF), np.nan), below_in_all=(CALF, 12.0))
    assert said(hidden) == ("left_calf", None, "left calf: hidden in all views, which usually show it")
    assert said(table(below=((0, CALF), np.nan), below_in_all=(CALF, 12.0))) is None


def test_contours_count_where_colours_say_nothing():
    found = table(contour_px=((0, CALF), 13.0))
    assert said(found) == ("left_calf", 0, "left calf: contour 13 px from edges in FRONT, usually 2 px")
    assert said(table(contour_px=((0, CALF), 11.0))) is None


def test_a_view_with_colours_alone_keeps_its_region(film_view):
    light = with_colors_only(film_view)
    assert light.colors is film_view.colors
    assert (light.corner_px, light.camera, light.theta_px) == (
        film_view.corner_px, film_view.camera, film_view.theta_px,
    )  # fmt: skip
    assert len(light.points_px) == light.distance.size == 0


@pytest.fixture
def film_view(gavrila):
    from region_scenes import CAMERAS
    from staging import own_evidence

    from tracker.body.model import PosedBody

    body = PosedBody(gavrila, gavrila.neutral())
    (view,) = own_evidence([body], CAMERAS[:1])
    return replace(view, colors=np.zeros((239, 319, 3), np.uint8), corner_px=(3, 4), image_size=(640, 480))
