"""People are detected in all views together: missed ones are sought where the others see them, and stored."""

import numpy as np
import pytest
from fake_detector import FakeDetector
from observed_people import make_session, seen, standing_points, walking

from tracker.errors import TrackerError
from tracker.interchange.detection.detect import DetectionPlan, detect_people
from tracker.interchange.observations.observed import triangulate_observations
from tracker.interchange.observations.stored import list_observations, load_observations

N = 12


@pytest.fixture
def couple(tmp_path):
    session = make_session(tmp_path / "s", N, people=("ann", "ben"))
    return session, [walking(N, (-0.6, 0.3, 0.0)), walking(N, (0.4, -0.7, 0.0), (-0.02, 0.02, 0.0))]


def run(session, detector, frames=range(N), name="net", report=lambda *_: None):
    return detect_people(session, detector, detector, DetectionPlan(name, "fake", frames), report)


def errors_m(session, motions, name="net", frames=range(N)):
    """Distances of the triangulated points from the truth, by whichever order of the people is nearer, metres."""
    triangulation = triangulate_observations(load_observations(session, name), [c.camera for c in session.cameras])
    truth = np.stack(motions, axis=1)[frames]
    own = triangulation.joints.joints_world[frames]
    return min((np.linalg.norm(own[:, order] - truth, axis=-1) for order in ([0, 1], [1, 0])), key=np.nanmean)


def test_people_are_found_and_placed(couple):
    session, motions = couple
    outcome = run(session, FakeDetector(seen(session, motions, noise_px=1.0)))
    assert (outcome.is_complete, outcome.n_figures, outcome.notes) == (True, (N,) * 4, ())
    assert np.nanmax(errors_m(session, motions)) < 0.05


def test_a_view_that_misses_someone_is_searched_where_the_others_see_the_person(couple):
    session, motions = couple
    points = seen(session, motions)
    detector = FakeDetector(points, unfound={(0, 0), (3, 1)})
    run(session, detector)
    px = load_observations(session, "net").points.points_px
    assert np.isfinite(px[..., 0, 0]).sum(axis=-1).tolist() == [[2] * 4] * N
    assert np.nanmax(errors_m(session, motions)) < 1e-3


def test_whole_pictures_are_searched_twice_a_second_while_everybody_is_seen(couple):
    session, motions = couple
    detector = FakeDetector(seen(session, motions))
    run(session, detector)
    assert detector.n_finds == 4 * 3, "the whole and two parts of four pictures, on the first frame"
    assert len(detector.looks) == 4 * 2 * N


def test_no_more_than_the_people_who_are_there_are_stored(couple):
    session, motions = couple
    run(session, FakeDetector(seen(session, motions)))
    assert load_observations(session, "net").points.points_px.shape[2] == 2


def test_a_stopped_detection_goes_on_and_ends_like_one_that_was_not(couple):
    session, motions = couple
    detector = FakeDetector(seen(session, motions))

    def stop(_, share, *text):
        if share > 0.5:
            raise KeyboardInterrupt

    outcome = run(session, detector, report=stop)
    assert (outcome.is_complete, outcome.frames) == (False, range(7))
    with pytest.raises(TrackerError, match="taken by those of detection, fake"):
        run(session, detector, range(3))
    assert run(session, detector).is_complete
    run(session, detector, name="whole")
    one, other = (load_observations(session, name).points for name in ("net", "whole"))
    np.testing.assert_array_equal(one.points_px, other.points_px)
    np.testing.assert_array_equal(one.colors, other.colors)
    assert np.isfinite(one.colors[one.is_known.any(axis=-1)]).all()
    with pytest.raises(TrackerError, match="which is complete"):
        run(session, detector)


def test_a_detection_that_sees_nobody_stores_nothing(couple):
    session, motions = couple
    everyone = {(v, p) for v in range(4) for p in range(2)}
    with pytest.raises(TrackerError, match="expected people in the pictures of frames 0 to 11, found none"):
        run(session, FakeDetector(seen(session, motions), unseen=everyone))
    assert list_observations(session) == []


@pytest.mark.parametrize(("people", "expected"), [
    (("ann",), "2 people are seen at once by three views or by all, the session has 1: those seen most are taken"),
    (("ann", "ben", "cid"), "2 of 3 people are seen at once by three views or by all"),
])  # fmt: skip
def test_other_numbers_of_people_are_noted(tmp_path, couple, people, expected):
    session = make_session(tmp_path / "other", N, people=people)
    outcome = run(session, FakeDetector(seen(session, couple[1])))
    assert (outcome.n_people, outcome.notes[0]) == (2, expected)


def run_alone(folder, points, **missed):
    """Detect people in a session of one person, and triangulate the person who is taken."""
    session = make_session(folder / "alone", len(points), people=("ann",))
    detector = FakeDetector(points, **missed)
    outcome = run(session, detector, range(len(points)))
    observations = load_observations(session, "net")
    return outcome, triangulate_observations(observations, [c.camera for c in session.cameras]).joints.joints_world[
        :, 0
    ]


def test_a_bystander_whom_two_views_see_is_no_person_of_the_recording(tmp_path, couple):
    session, motions = couple[0], [np.concatenate([m, m[::-1]]) for m in couple[1]]
    found, own = run_alone(tmp_path, seen(session, motions), unseen={(1, 0), (3, 0)})
    names = session.camera_names
    assert (found.n_people, found.notes) == (
        1, (f"a further person is seen by {names[0]} and {names[2]}, and left out",)
    )  # fmt: skip
    assert np.abs(own - motions[1]).max() < 1e-3


@pytest.mark.slow
def test_a_poster_is_taken_last_though_it_is_always_there(tmp_path, couple):
    session, motion = couple[0], np.concatenate([couple[1][0], couple[1][0][::-1], couple[1][0]])
    poster = np.repeat(standing_points()[None], 3 * N, axis=0)
    poster[..., 0] = 1.2
    points = seen(session, [poster, motion], noise_px=0.5)
    points[:N, :, 1] = -1000.0
    found, own = run_alone(tmp_path, points)
    assert found.n_people == 1
    assert "a flat picture of a person is seen by " in found.notes[-1]
    assert np.abs(own[-1] - motion[-1]).max() < 0.05
    assert np.isnan(own[0]).all()


def test_a_view_that_places_people_somewhat_apart_sees_the_same_people(couple):
    session, motions = couple[0], [np.repeat(m[:1], N, axis=0) for m in couple[1]]
    points, aside = seen(session, motions), seen(session, [m + np.array([0.0, 0.0, 0.3]) for m in motions])
    points[:, 0], points[0, 2] = aside[:, 0], aside[0, 2]
    n_people = run(session, FakeDetector(points)).n_people
    triangulation = triangulate_observations(load_observations(session, "net"), [c.camera for c in session.cameras])
    assert (triangulation.identities >= 0).all()
    assert n_people == 2


def test_people_of_one_view_alone_are_refused_by_its_name(couple):
    session, motions = couple
    others = {(v, p) for v in (0, 1, 3) for p in range(2)}
    view = session.camera_names[2]
    with pytest.raises(TrackerError, match=f"two views show at one place, found those of fake in {view} at none"):
        run(session, FakeDetector(seen(session, motions), unseen=others))
    assert list_observations(session) == []


def test_a_child_is_looked_for_in_a_smaller_square(couple):
    session, motions = couple
    sides = []
    for scale in (1.0, 0.5):
        detector = FakeDetector(seen(session, [scale * motions[0]]))
        run(session, detector, name=str(scale))
        sides.append(detector.looks[-1].side_px)
    assert sides[1] == pytest.approx(0.5 * sides[0], rel=0.1)


def test_someone_who_enters_late_is_found(couple):
    session, motions = couple
    points = seen(session, [np.repeat(m, 4, axis=0) for m in motions])[: 4 * N]
    points[:20, :, 1] = -1000.0
    session = make_session(session.folder.parent / "long", 4 * N, people=("ann", "ben"))
    outcome = run(session, FakeDetector(points), range(4 * N))
    px = load_observations(session, "net").points.points_px
    first = np.isfinite(px[:, :, 1, 0, 0]).all(axis=1).argmax()
    assert 20 <= first <= 20 + 0.5 * session.fps
    assert outcome.notes == (f"a person is seen on frames {first} to {4 * N - 1} alone",)
