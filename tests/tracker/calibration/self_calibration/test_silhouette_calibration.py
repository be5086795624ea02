"""Cameras from silhouettes of a simulated person, against the true ones."""

import numpy as np
import pytest
from filmed_people import FOCAL_PX, aligned, blanks, rig
from person_outlines import outlined

from tracker.calibration.self_calibration.person_silhouettes import Flaw, PersonSilhouette
from tracker.calibration.self_calibration.silhouette_calibration import calibrate_by_silhouettes, under_floor_notes
from tracker.errors import CalibrationError

CAMERAS = rig(3)
STATURE_M = 1.70


def flawed(rows, camera, flaw, keeps_hull=False):
    """The same silhouettes with a flaw in a camera, or in all where it is None."""

    def changed(s):
        return PersonSilhouette(s.hull_px, flaw=flaw) if keeps_hull else PersonSilhouette(flaw=flaw)

    return [[changed(s) if camera in (None, i) else s for i, s in enumerate(row)] for row in rows]


@pytest.mark.slow
@pytest.mark.parametrize("has_lenses", [True, False])
def test_cameras_are_found_from_silhouettes_alone(has_lenses):
    rows, _ = outlined(CAMERAS, 24, noise_px=0.3)
    lenses = CAMERAS if has_lenses else blanks(CAMERAS)
    calibration = calibrate_by_silhouettes(rows, lenses, STATURE_M, has_lenses)
    a, b = (np.array([c.center_world for c in cameras]) for cameras in (calibration.cameras, CAMERAS))
    scale, R, t = aligned(a, b)
    assert np.linalg.norm(scale * a @ R.T + t - b, axis=1).max() < 0.1
    assert np.degrees(np.arccos(R[2, 2])) < 5
    assert scale == pytest.approx(1.0, abs=0.15)  # the head of spheres is low
    assert np.median(calibration.held_out.px) < 1.5
    assert calibration.volume.expected_m < 0.02
    focal = np.array([c.K[0, 0] for c in calibration.cameras])
    assert np.all(np.abs(focal / FOCAL_PX - 1) < (1e-9 if has_lenses else 0.03))
    assert calibration.points == "frontier points"
    assert abs(scale - 1) < 2 * calibration.scale_sigma
    assert calibration.scale_sigma > 0.04  # ends of silhouettes are no points of the body


@pytest.mark.parametrize(
    ("camera", "flaw", "message"),
    [
        (1, Flaw.CUT, r"camera 'cam1' together with another.*found 0 \(of its silhouettes, 4 cut the person at the "
         r"border\); keep the whole person in the pictures"),
        (2, Flaw.SEVERAL, r"camera 'cam2'.*4 show several people\); film one person, or leave the others out"),
        (None, Flaw.NOBODY, r"camera 'cam0'.*4 show nobody\); film the person where the cameras see the same place"),
    ],
)  # fmt: skip
def test_silhouettes_that_do_not_count_are_named(camera, flaw, message):
    rows, _ = outlined(CAMERAS, 4)
    with pytest.raises(CalibrationError, match=message):
        calibrate_by_silhouettes(flawed(rows, camera, flaw), CAMERAS, STATURE_M, True)


def test_a_person_who_never_stands_upright_is_refused():
    rows, _ = outlined(CAMERAS, 4)
    with pytest.raises(CalibrationError, match="upright in two cameras on at least 3 frames, found 0; let the person"):
        calibrate_by_silhouettes(flawed(rows, None, Flaw.BENT, True), CAMERAS, STATURE_M, True)


@pytest.mark.slow
def test_a_person_who_stands_still_is_refused():
    rows, _ = outlined(CAMERAS, 1)
    with pytest.raises(CalibrationError, match="let the person walk through the volume"):
        calibrate_by_silhouettes(8 * rows, blanks(CAMERAS), STATURE_M, False)


@pytest.mark.parametrize(("share", "notes"), [(0.0, 0), (0.01, 0), (0.05, 1), (1.0, 1)])
def test_points_under_the_floor_are_noted(share, notes):
    points = np.random.default_rng(0).uniform((-1, -1, 0), (1, 1, 1.8), (100, 10, 3))
    points[:, 0] = np.nan
    points[: round(100 * share), 1:, 2] -= 2.5
    found = under_floor_notes(points)
    assert len(found) == notes
    assert all("m under the floor: check that all silhouettes are of one person" in note for note in found)
    assert under_floor_notes(np.full((2, 3), np.nan)) == ()
