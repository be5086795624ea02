"""A start pose against the silhouettes of a person whose proportions and shape no body model has."""

import numpy as np
import pytest
from figures import cameras_about_a_figure, figure, parts_of, silhouettes_of_figure

from tracker.body.model import PosedBody
from tracker.estimation.initialization.generators.voxel_start import start_pose
from tracker.estimation.initialization.silhouette_check import check_against_silhouettes
from tracker.evidence.voxels.figure_masks import figure_masks
from tracker.formats.model_toml import load_model


@pytest.fixture(scope="module")
def scene():
    """A start on a figure with holes in its surface, and the figure's silhouettes."""
    voxels, _ = figure(noise=0.1)
    model = load_model("gavrila34", 1.72)
    silhouettes = silhouettes_of_figure(voxels, cameras_about_a_figure())
    return PosedBody(model, start_pose(model, parts_of(voxels))), silhouettes, figure_masks(silhouettes, voxels)


def changed(body, **dofs):
    values = body.values.copy()
    for name, value in dofs.items():
        values[body.model.value_names.index(name.replace("__", "."))] += value
    return PosedBody(body.model, values)


@pytest.mark.slow
def test_a_right_start_passes(scene):
    check = check_against_silhouettes(*scene)
    assert check.cameras == ("c0", "c1", "c2", "c3")
    assert not check.is_refused
    assert check.note == ""


@pytest.mark.parametrize("name", ["x", "y", "z"])
def test_a_body_beside_the_person_is_refused(scene, name):
    body, *views = scene
    place = next(n for n in body.model.value_names if n.split(".")[-1].lower() in (name, f"t{name}"))
    check = check_against_silhouettes(changed(body, **{place: 0.5}), *views)
    assert check.is_refused
    assert check.note.startswith("the body and the silhouette share little of their area in view c")
    assert check.worst_camera == check.cameras[np.argmin(check.overlaps)]


def test_a_body_out_of_all_images_is_refused(scene):
    body, *views = scene
    values = body.values.copy()
    values[:3] += 50.0
    assert check_against_silhouettes(PosedBody(body.model, values), *views).is_refused


def test_without_a_view_of_the_person_alone_nothing_is_checked(scene):
    body, silhouettes, masks = scene
    check = check_against_silhouettes(body, silhouettes, [m._replace(is_apart=False) for m in masks])
    assert not check.is_refused
    assert check.note.startswith("no view shows the person alone")
    assert np.size(check.overlaps) == 0
    assert check.worst_camera is None
