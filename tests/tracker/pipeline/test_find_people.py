"""People found with nobody's help: which frames are tried, what is said where nobody can be found, what is stored."""

import threading
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from figures import cameras_about_a_figure, figure, hide_legs, silhouettes_of_figure
from solids import ellipsoid, silhouettes_of

from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.estimation.fitting.hypothesis import Hypothesis
from tracker.estimation.initialization import first_pose, frame_trials, own_figure
from tracker.estimation.initialization.first_pose import FirstPose, FirstPoses
from tracker.estimation.initialization.frame_trials import TakenError, find_first_poses, find_first_poses_anywhere
from tracker.estimation.initialization.generators.start_generators import GENERATORS, from_voxels
from tracker.estimation.initialization.start_fit import StartTrack
from tracker.evidence.voxels.visual_hull import VisualHull
from tracker.formats.model_toml import format_model
from tracker.pipeline.body_acquisition import SIZES_EDITS, sizes_changed, with_sizes_changed
from tracker.pipeline.find_people import AXES, FindSettings, find_people, frames_to_try, store_found
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore

NAMES = ("FRONT", "RIGHT", "BACK", "LEFT")
CAMERAS = [replace(c, name=n) for c, n in zip(cameras_about_a_figure(), NAMES, strict=True)]
HALF = np.array([0.17, 0.17, 0.6])


@pytest.fixture
def silhouettes(monkeypatch):
    """What is seen on every frame, a list that tests fill."""
    seen = []
    finder = SimpleNamespace(silhouettes=lambda k, person=None: tuple(seen), close=lambda: None)
    monkeypatch.setattr(frame_trials, "SilhouetteFinder", lambda cameras, recording, step: finder)
    return seen


@pytest.fixture
def fits(monkeypatch):
    """Every start fits as it is; the second way of facing costs more."""
    costs = iter(np.arange(10.0, 1000.0, 10.0))
    monkeypatch.setattr(first_pose, "StartFitter", fitter(track=lambda start: (start.pose, next(costs))))


def fitter(track, status=lambda start: "good", step=lambda: None):
    """Stands for the class that fits starts: they fit as they are, and tracks give a pose and a cost, nats."""

    def fitted(start):
        step()
        return start

    def tracked(start):
        pose, cost = track(start)
        return StartTrack(replace(start.at(pose), cost=cost), status(start), 1.0, {3: pose})

    return lambda *_: SimpleNamespace(
        fit=fitted, search=fitted, track=tracked,
        scored=lambda starts: [replace(s, cost=0.0) for s in starts],
        compared=lambda tracks: sorted(tracks, key=lambda t: t.start.cost),
    )  # fmt: skip


OBSERVER = SimpleNamespace(recording=None)


def frames_in(tried):
    """Return what adds each frame that is tried to a list."""

    def show(trying):
        if trying.frame is not None and trying.frame not in tried:
            tried.append(trying.frame)

    return show


def find(session, size_m=0.05):
    return find_first_poses(session, OBSERVER, [0], [3], size_m=size_m)


def test_frames_are_tried_far_from_one_another():
    tried = frames_to_try(range(100), None)
    assert tried[:3] == [50, 4, 95]
    assert len(tried) == len(set(tried)) == 12
    assert frames_to_try(range(10, 14), 12) == [12, 10, 11, 13]
    assert set(frames_to_try(range(0, 60, 3), None)) <= set(range(0, 60, 3))


@pytest.mark.slow
def test_a_stop_is_heard_between_two_fits_of_a_frame(session, silhouettes, monkeypatch):
    silhouettes += silhouettes_of_figure(figure()[0], CAMERAS)
    is_stopping = False
    fitted = []

    def starts(observer, frame, later, others, step):
        def fit():
            nonlocal is_stopping
            fitted.append(frame)
            is_stopping = True
            step()

        return fitter(lambda start: (start.pose, 0.0), step=fit)()

    def report(stage, share, text):
        if is_stopping:
            raise InterruptedError

    monkeypatch.setattr(first_pose, "StartFitter", starts)
    with pytest.raises(InterruptedError):
        find_people(session, OBSERVER, [0], range(3, 4), FindSettings(), report)
    assert len(fitted) == 1


@pytest.mark.slow
def test_a_generator_is_added_by_an_entry_and_tried_where_the_others_propose_nothing(
    session, silhouettes, fits, monkeypatch
):
    silhouettes += silhouettes_of_figure(figure()[0], CAMERAS)

    def proposed(scene, model, is_known):
        return [replace(h, source="mine") for h in from_voxels(scene, model, is_known)]

    def nothing(scene, model, is_known):
        raise TrackerError("expected a head, found none")

    generators = {**dict.fromkeys(GENERATORS, nothing), "mine": proposed}
    for room in (first_pose, frame_trials):
        monkeypatch.setattr(room, "GENERATORS", generators)
    said = []
    first = find_first_poses_anywhere(session, OBSERVER, [0], [3], 0.05, said.append)
    assert first.poses[0].start.source == "mine"
    assert [text.split(":")[0] for text in said] == [f"frame 3, {name}" for name in generators]


def searched(session, monkeypatch, statuses, heights, show=lambda trying: None):
    """Search four frames that give starts of some statuses and heights, by person; return the start and the trials."""
    bodies = session.people[0].model

    def poses_on(trial, frame, generators):
        people = zip(statuses[frame], heights[frame], strict=True)
        posed = [(s, PosedBody(b := bodies.with_height(h), b.neutral())) for s, h in people]
        poses = {i: FirstPose(frame, Hypothesis(p, "axis"), s, 9.0 - frame, True, ()) for i, (s, p) in enumerate(posed)}
        return FirstPoses(frame, poses)

    trials = []
    monkeypatch.setattr(frame_trials._Trial, "_poses_on", poses_on)
    found = find_first_poses_anywhere(
        session, OBSERVER, [0, 1], range(4), 0.05, show=lambda trying: (trials.append(trying), show(trying))
    )
    return found, [t for k, t in enumerate(trials) if t[:2] != trials[k - 1][:2]]


GOOD, DOUBTFUL = ("good", "good"), ("good", "doubtful")


@pytest.mark.parametrize(
    ("statuses", "heights", "n_tried", "start"),
    [
        ([GOOD, GOOD, GOOD, GOOD], [(1.8, 1.6), (1.6, 1.8), (1.8, 1.6), (1.8, 1.6)], 2, 1),
        ([GOOD, DOUBTFUL, GOOD, GOOD], [(1.8, 1.6)] * 4, 3, 2),
        ([GOOD, GOOD, DOUBTFUL, GOOD], [(1.8, 1.6), (1.4, 1.4), (1.8, 1.6), (1.8, 1.6)], 4, 3),
        ([DOUBTFUL, DOUBTFUL, GOOD, DOUBTFUL], [(1.8, 1.6)] * 4, 4, 2),
    ],
)
def test_two_good_frames_whose_heights_agree_end_the_search(
    session, silhouettes, monkeypatch, statuses, heights, n_tried, start
):
    """People may come in another order on each frame; a doubtful start confirms no good one."""
    found, trials = searched(session, monkeypatch, statuses, heights)
    assert found.frame == start
    assert len({t.frame for t in trials} - {None}) == n_tried


def test_a_longest_time_is_said_once_no_other_generator_can_follow(session, silhouettes, monkeypatch):
    """Others take another time, which nobody knows before."""
    _, trials = searched(session, monkeypatch, [DOUBTFUL, GOOD, DOUBTFUL, DOUBTFUL], [(1.8, 1.6)] * 4)
    known = [t.left_s is not None for t in trials if t.frame is not None]
    assert known == [False, False, True, True]
    _, doubtful = searched(session, monkeypatch, [DOUBTFUL] * 4, [(1.8, 1.6)] * 4)
    assert not any(t.left_s is not None for t in doubtful if not t.generators)


def test_a_search_shows_its_frames_and_can_be_ended_with_the_best(session, silhouettes, monkeypatch):
    def take(trying):
        if trying.number == 3:
            raise TakenError

    found, trials = searched(session, monkeypatch, [DOUBTFUL] * 4, [(1.8, 1.6)] * 4, take)
    assert found.frame == 1  # that which costs least so far
    last = trials[-1]
    assert (last.frame, last.text, last.share, last.best) == (2, "trying frame 3 of 4", 0.5, found)
    assert last._replace(n_figures=1).text == "trying frame 3 of 4, 1 person's figure seen"
    assert last._replace(n_figures=3).text == "trying frame 3 of 4, 3 people's figures seen"
    assert found.is_credible


@pytest.mark.slow
def test_frames_on_which_silhouettes_agree_go_first(session, silhouettes, fits, monkeypatch):
    whole = silhouettes_of_figure(figure()[0], CAMERAS)
    poor = [whole[0]._replace(mask=whole[0].mask | np.roll(whole[0].mask, 60, axis=1)), *whole[1:]]
    nobody = [s._replace(mask=np.zeros_like(s.mask)) for s in whole]
    seen = SimpleNamespace(silhouettes=lambda k, person=None: {20: nobody, 10: poor}.get(k, whole), close=lambda: None)
    monkeypatch.setattr(frame_trials, "SilhouetteFinder", lambda cameras, recording, step: seen)
    tried = list[int]()
    find_first_poses_anywhere(session, OBSERVER, [0], [20, 10, 30, 15], 0.05, show=frames_in(tried))
    assert tried == [30, 15]


@pytest.mark.slow
@pytest.mark.parametrize(("n_views", "n_voxels"), [(4, 4), (8, 2)])
def test_the_search_ends_after_so_many_pictures(session, silhouettes, monkeypatch, n_views, n_voxels):
    silhouettes += silhouettes_of_figure(figure()[0], CAMERAS)
    session = replace(session, cameras=(session.cameras * 2)[:n_views])

    def nothing(scene, model, is_known):
        raise TrackerError("expected a head, found none")

    monkeypatch.setattr(first_pose, "GENERATORS", dict.fromkeys(GENERATORS, nothing))
    said = []
    with pytest.raises(TrackerError, match="found none of 12: expected a head, found none") as error:
        find_first_poses_anywhere(session, OBSERVER, [0], range(12), 0.05, said.append)
    assert error.value.remedy.code == "find_otherwise"
    tried = [text.split(":")[0].split(", ")[1] for text in said]
    assert tried == ["voxels"] * n_voxels + ["axis", "search"]


@pytest.mark.slow
def test_the_first_two_frames_are_tried_at_the_same_time(session, silhouettes, monkeypatch):
    silhouettes += silhouettes_of_figure(figure()[0], CAMERAS)
    at_once = threading.Barrier(2, timeout=20)
    shown = list[int]()

    def starts(observer, frame, later, others, step):
        at_once.wait()
        costs = iter(np.arange(10.0, 1000.0, 10.0))
        return fitter(lambda start: (start.pose, next(costs)))()

    monkeypatch.setattr(first_pose, "StartFitter", starts)
    found = find_first_poses_anywhere(session, OBSERVER, [0], [20, 10, 30], 0.05, show=frames_in(shown))
    assert shown == [20, 10]  # as if one after the other
    assert found.frame == 20


@pytest.mark.slow
def test_a_stop_ends_both_frames(session, silhouettes, monkeypatch):
    silhouettes += silhouettes_of_figure(figure()[0], CAMERAS)
    at_once, ended = threading.Barrier(2, timeout=20), []

    def starts(observer, frame, later, others, step):
        at_once.wait()
        if frame == 20:
            raise InterruptedError
        end = time.monotonic() + 20
        try:
            while time.monotonic() < end:
                step()
        except Exception:
            ended.append(frame)
            raise
        return fitter(lambda start: (start.pose, 1.0))()

    monkeypatch.setattr(first_pose, "StartFitter", starts)
    with pytest.raises(InterruptedError):
        find_first_poses_anywhere(session, OBSERVER, [0], [20, 10, 30], 0.05)
    assert ended == [10]


@pytest.mark.slow
def test_nobody_in_the_silhouettes(session, silhouettes):
    silhouettes += [s._replace(mask=np.zeros_like(s.mask)) for s in silhouettes_of_figure(figure()[0], CAMERAS)]
    with pytest.raises(TrackerError, match="expected somebody in the silhouettes of at least 2 views, found none"):
        find(session)


@pytest.mark.slow
def test_two_people_where_one_was_announced(session, silhouettes):
    people = [ellipsoid((0.0, -0.6, 0.9), HALF), ellipsoid((0.0, 0.6, 0.9), HALF)]
    silhouettes += silhouettes_of(people, CAMERAS)
    with pytest.raises(TrackerError, match="expected 1 person as the session has, found 2 figures that stand apart"):
        find(session)


@pytest.mark.slow
def test_a_camera_that_moved_is_named(session, silhouettes, fits, monkeypatch):
    monkeypatch.setattr(own_figure, "_MAX_HULL_M3", 0.5)  # three views leave a wide hull
    views = silhouettes_of_figure(figure()[0], CAMERAS)
    part = views[1].mask.copy()
    part[int(np.flatnonzero(part.any(axis=1)).mean()) :] = False
    moved = views[1]._replace(mask=np.roll(views[1].mask, 130, axis=1) | part)
    silhouettes += [views[0], moved, *views[2:]]
    found = find(session, 0.03).poses[0]
    notes = " ".join(found.notes)
    assert "view RIGHT was left out" in notes
    assert "cut off" not in notes
    assert found.status == "good"  # the others agree, and the view that was left out checks nothing


def test_several_cameras_that_moved_are_an_error(session, silhouettes):
    views = silhouettes_of_figure(figure()[0], CAMERAS)
    silhouettes += [v._replace(mask=np.roll(v.mask, 110 * i, axis=1)) for i, v in enumerate(views)]
    with pytest.raises(TrackerError, match="no camera has moved"):
        find(session)


@pytest.mark.slow
def test_a_person_cut_off_by_the_image(session, silhouettes, fits):
    views = silhouettes_of_figure(figure()[0], CAMERAS)
    bottom = int(views[0].mask.any(axis=1).nonzero()[0][-1])
    height = bottom - 20
    camera = views[0].camera.cropped((0, 0, views[0].camera.width, height))
    silhouettes += [views[0]._replace(mask=views[0].mask[:height], camera=camera), *views[1:]]
    assert "cut off by the image in view FRONT" in find(session).poses[0].notes


def off_by(places, monkeypatch):
    """Fits that are called good and have moved by metres along x, each by the next of some places."""
    places = iter(places)

    def track(start):
        moved = start.pose.copy()
        moved[0] += next(places)
        return moved, 1.0

    monkeypatch.setattr(first_pose, "StartFitter", fitter(track))


@pytest.mark.slow
def test_a_body_in_empty_space_is_refused(session, silhouettes, monkeypatch):
    silhouettes += silhouettes_of_figure(figure(noise=0.1)[0], CAMERAS)
    off_by([0.6] * 10, monkeypatch)
    with pytest.raises(TrackerError, match="expected a body that fills the silhouettes, found none: the body and"):
        find(session)


@pytest.mark.slow
def test_another_start_takes_its_place(session, silhouettes, monkeypatch):
    silhouettes += silhouettes_of_figure(figure(noise=0.1)[0], CAMERAS)
    off_by([0.6] + [0.0] * 9, monkeypatch)
    found = find(session).poses[0]
    assert found.status == "good"
    assert not any("share little" in note for note in found.notes)


@pytest.mark.slow
def test_legs_that_look_like_shadows_are_found(session, silhouettes, monkeypatch):
    voxels, joints = figure(noise=0.1)
    legs = ("left_knee", "right_knee", "left_ankle", "right_ankle")

    def errors(model, pose):
        points = dict(zip(model.point_names, model.points_world(pose), strict=True))
        return [np.linalg.norm(points[n] - joints[n]) for n in legs]

    def is_near(start):
        return max(errors(start.model, start.pose)) < 0.3

    def track(start):
        if not is_near(start):
            return start.pose, 200.0  # nats: legs that lie elsewhere
        known = {n: p for n, p in joints.items() if n in start.model.point_names}
        return fit_to_points(start.model, known).pose, 1.0

    fits = fitter(track, lambda start: "good" if is_near(start) else "doubtful")
    monkeypatch.setattr(first_pose, "StartFitter", fits)
    whole = silhouettes_of_figure(voxels, CAMERAS)
    silhouettes += hide_legs(whole, {0, 2}, [np.zeros_like(s.mask) for s in whole])
    found = find(session).poses[0]
    assert max(errors(found.model, found.start.pose)) < 0.3
    # Shadows are asked only where a start is not good without them.
    monkeypatch.setattr(frame_trials, "recover_from_shadows", None)
    silhouettes[:] = whole
    assert find(session).is_good


@pytest.mark.slow
def test_a_start_that_one_view_contradicts_is_doubtful(session, silhouettes, fits, monkeypatch):
    silhouettes += silhouettes_of_figure(figure(noise=0.1)[0], CAMERAS)
    painted = first_pose.figure_masks

    def with_upper_half(*arguments):
        first, *others = painted(*arguments)
        rows = np.flatnonzero(first.mask.any(axis=1))
        mask = first.mask.copy()
        mask[int(rows.mean()) :] = False
        return first._replace(mask=mask), *others

    monkeypatch.setattr(first_pose, "figure_masks", with_upper_half)
    found = find(session).poses[0]
    assert found.status == "doubtful"
    assert "share little of their area in view FRONT" in " ".join(found.notes)


def test_both_ways_of_facing_are_compared(session, silhouettes, fits):
    silhouettes += silhouettes_of_figure(figure(turn_deg=40)[0], CAMERAS)
    first = find(session).poses[0]
    assert first.is_facing_sure  # the second track costs 10 nats more
    assert set(first.lines_px) <= set(NAMES)


def off_frame(session, status):
    """Stands for a track from a start: it moves by a centimetre, and ends with a status."""

    def track(start):
        return StartTrack(start.at(start.pose + 0.01), status, 2.0, {3: start.pose})

    return lambda *_: SimpleNamespace(track=track)


@pytest.mark.parametrize(("status", "is_moved"), [("good", True), ("doubtful", False), ("lost", False)])
def test_a_known_start_follows_the_contours_that_agree(session, monkeypatch, status, is_moved):
    monkeypatch.setattr(first_pose, "StartFitter", off_frame(session, status))
    known = known_people(session)
    found = first_pose.fit_to_contours(session, OBSERVER, known).poses[0]
    assert found.status == ("good" if is_moved else "doubtful")
    assert np.allclose(found.start.pose - known.poses[0].start.pose, 0.01 * is_moved)


def known_people(session):
    first = found_people(session, 1.0).poses[0]
    return FirstPoses(7, {0: first._replace(status="doubtful", cost_px=np.nan, start=replace(first.start, source="x"))})


@pytest.mark.parametrize("status", ["good", "doubtful"])
def test_key_points_of_the_session_go_first_and_silhouettes_follow_where_contours_contradict(
    session, monkeypatch, status
):
    good, known = found_people(session, 1.0), known_people(session)
    asked = []
    module = "tracker.pipeline.find_people."

    def by_points(session, people, frames, name):
        asked.append(name)
        if name == "joints":
            raise TrackerError("expected key points of 'person' in 'joints', found none")
        return known

    def fitted(session, observer, found, step):
        return FirstPoses(7, {0: found.poses[0]._replace(status=status)})

    monkeypatch.setattr(module + "list_observations", lambda session: ["joints", "net"])
    monkeypatch.setattr(module + "find_by_keypoints", by_points)
    monkeypatch.setattr(module + "fit_to_contours", fitted)
    monkeypatch.setattr(module + "find_first_poses_anywhere", lambda *_: good)
    found = find_people(session, OBSERVER, [0], range(9), FindSettings())
    assert asked == ["joints", "net"]
    assert found.poses[0].start.source == ("x" if status == "good" else "axis")
    named = find_people(session, OBSERVER, [0], range(9), FindSettings(keypoints="net"))
    assert named.poses[0].start.source == "x"  # silhouettes are not asked where key points are named

    def nobody(*_):
        raise TrackerError("expected a frame on which people are found by their silhouettes, found none")

    monkeypatch.setattr(module + "find_first_poses_anywhere", nobody)
    assert find_people(session, OBSERVER, [0], range(9), FindSettings()).poses[0].start.source == "x"


def found_people(session, scale):
    model = session.people[0].model
    body = model.with_height(scale * model.height_m)
    start = Hypothesis(PosedBody(body, body.neutral()), "axis")
    lines = {"FRONT": np.array([[[1.0, 2.0], [3.0, 4.0]]])}
    first = FirstPose(7, start, "good", 1.0, True, ("a note",), lines)
    return FirstPoses(7, {0: first})


@pytest.mark.parametrize("scale", [1.0, 1.05])
def test_poses_and_bodies_are_one_entry_of_the_history(session, scale):
    found = found_people(session, scale)
    with AnnotationStore(session.annotations_path) as store:
        changed = store_found(session, store, found)
        (entry,) = store.history()
        record = store.pose("person", 7)
        assert (record.remark, record.status, record.keyframe) == ("a note", "good", False)
        assert record.settings["method"] == "axis"
        assert store.setting(AXES) == {"frame": 7, "lines": {"FRONT": [[[[1.0, 2.0], [3.0, 4.0]]]]}}
        sizes = sizes_changed(store.setting(SIZES_EDITS, {}), entry.edit)
        assert [name for name, _, _ in sizes] == (["person"] if scale != 1.0 else [])
    assert changed.people[0].model.height_m == pytest.approx(found.poses[0].model.height_m)
    assert format_model(load_session(session.folder).people[0].model) == format_model(changed.people[0].model)


def test_an_entry_of_one_person_is_read_as_before():
    assert sizes_changed({"5": ["ann", 1, 2]}, 5) == [("ann", 1, 2)]  # as an older version stored it
    changed = [("ann", 1, 2), ("bob", 3, 4)]
    edits = with_sizes_changed(with_sizes_changed({}, 4, changed[:1]), 5, changed)
    assert [sizes_changed(edits, edit) for edit in (4, 5)] == [changed[:1], changed]
    again = with_sizes_changed(edits, 5, [("bob", 4, 7)])  # the same entry: undone in one step
    assert sizes_changed(again, 5) == [("ann", 1, 2), ("bob", 3, 7)]
    assert sizes_changed({"5": ["ann", 1, 2]}, 6) == []


@pytest.mark.parametrize(
    ("coverages", "camera", "remedy"),
    [
        ([1.0, 1.0, 0.85, 0.6], "LEFT", "another_frame_or_background"),
        ([1.0, 0.99, np.nan, 0.97], None, "another_frame"),
    ],
)
def test_a_figure_that_is_too_large_names_the_silhouette_that_shows_more_than_people(
    session, coverages, camera, remedy
):
    figure = SimpleNamespace(volume_m3=0.35, points_world=np.zeros((1, 3)))
    with pytest.raises(TrackerError, match="at most 250 litres, found a figure of 350") as error:
        own_figure.own_figure(session, 0, VisualHull((figure,), np.array(coverages), ()), [])
    assert (error.value.camera, error.value.remedy.code) == (camera, remedy)
    assert camera is None or f"the silhouette in {camera}" in str(error.value)
