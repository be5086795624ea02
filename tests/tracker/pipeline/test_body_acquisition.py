"""A body acquired in a session: which frames count, what is stored, and that keyframes follow."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tracker.body.dimensions import STATED_HEIGHT_SIGMA
from tracker.errors import TrackerError
from tracker.estimation.acquisition.from_contours import Acquisition, AcquisitionSettings
from tracker.estimation.acquisition.size_parameters import SizeParameters, SizePriors
from tracker.estimation.initialization.first_pose import HEIGHT_SIGMA
from tracker.evidence.observer import open_observer
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.model_toml import format_model, has_preset_proportions, has_preset_sizes, load_model
from tracker.geometry.triangulation import sigma_px
from tracker.pipeline import body_acquisition
from tracker.pipeline.body_acquisition import MEASURED, PLACED_M, SIZES_EDITS, acquire_body, posed_frames, store_body
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PinChange, PoseChange, PoseRecord


@pytest.fixture
def store(session):
    with AnnotationStore(session.annotations_path) as store:
        yield store


def record(session, store, **changes):
    person = session.people[0]
    revision = store.add_model_revision(person.name, format_model(person.model))
    values = person.model.neutral()
    return replace(PoseRecord(values, ("manual",) * len(values), revision), **changes)


def put(session, store, **records):
    """Store poses by frame: `f3=...`."""
    name = session.people[0].name
    store.commit("put", [PoseChange(name, int(k[1:]), r) for k, r in records.items()])


def test_keyframes_and_good_frames_count(session, store):
    tracked = ("tracked",) * len(session.people[0].model.neutral())
    put(
        session, store,
        f0=record(session, store, keyframe=True),
        f1=record(session, store, sources=tracked, status="good"),
        f2=record(session, store, sources=tracked, status="doubtful"),
        f3=record(session, store, sources=tracked, status="lost"),
        f4=record(session, store, sources=tracked, keyframe=True, status="good"),
    )  # fmt: skip
    found = posed_frames(session, 0, range(10))
    assert sorted(found.bodies) == [0, 1, 4]
    # A tracked pose that somebody has confirmed shows where the flesh is, not where the joints are.
    assert sorted(found.placed) == [0]
    assert found.placed[0].weights[0] == pytest.approx(1 / PLACED_M)


def test_doubtful_frames_count_where_there_is_nothing_better(session, store):
    put(session, store, f2=record(session, store, status="doubtful"), f3=record(session, store, status="lost"))
    assert sorted(posed_frames(session, 0, range(10)).bodies) == [2]
    with pytest.raises(TrackerError, match="from 3 to 9"):
        posed_frames(session, 0, range(3, 10))


def test_known_joints_count_more_than_the_pose_fitted_to_them(session, store):
    joints = {n: [0.1 * i, 0.0, 1.0] for i, n in enumerate(LIMB_JOINTS)}
    put(session, store, f0=record(session, store, keyframe=True, settings={"method": "joints", "joints": joints}))
    placed = posed_frames(session, 0, range(10)).placed[0]
    names = [session.people[0].model.point_names[i] for i in placed.points]
    np.testing.assert_allclose(placed.targets_world, [joints[n] for n in names])


def test_seen_points_count_more_than_the_pose(session, store):
    """The ends of drags, and pins before them; in undistorted pixels, with a hand's accuracy."""
    name, camera = session.people[0].name, session.cameras[1].camera
    seen = {"left_wrist": {camera.name: [100.0, 200.0], "gone": [1.0, 2.0]}, "head": {camera.name: [50.0, 60.0]}}
    put(session, store, f0=record(session, store, keyframe=True, settings={"seen": seen}))
    store.commit("pin", [PinChange(name, 0, "head", camera.name, (55.0, 65.0))])
    found = posed_frames(session, 0, range(10))
    block = found.seen[0]
    names = [session.people[0].model.point_names[i] for i in block.points]
    assert dict(zip(names, block.positions_px.tolist(), strict=True)) == {
        "head": pytest.approx(camera.undistort_points(np.array([55.0, 65.0]))),
        "left_wrist": pytest.approx(camera.undistort_points(np.array([100.0, 200.0]))),
    }
    assert block.sigmas_px[0] == pytest.approx(3 * sigma_px(camera))
    assert not found.placed


def larger(model):
    parameters = SizeParameters(model)
    sizes = np.zeros(len(parameters.names))
    sizes[0] = 0.05
    return parameters.body(sizes)


def test_keyframes_are_fitted_to_the_new_body_and_undone_with_it(session, store):
    first, second = record(session, store, keyframe=True), record(session, store, keyframe=True)
    put(session, store, f0=first, f5=second, f6=record(session, store, status="good"))
    name, body = session.people[0].name, larger(session.people[0].model)
    acquired = body.neutral() + 0.01
    store_body(session, store, 0, body, {5: acquired}, "acquire")
    changed = load_session(session.folder)
    assert format_model(changed.people[0].model) == format_model(body)
    np.testing.assert_allclose(store.pose(name, 5).values, acquired)
    joints = body.points_world(store.pose(name, 0).values)
    assert np.abs(joints - session.people[0].model.points_world(first.values)).max() < 0.06
    revision = store.pose(name, 0).model_revision
    assert revision == store.pose(name, 5).model_revision != first.model_revision
    assert store.pose(name, 6).model_revision == first.model_revision  # not a keyframe: it keeps its body
    ((edit, ((who, before, after),)),) = store.setting(SIZES_EDITS).items()
    assert (who, before, after) == (name, first.model_revision, revision)
    assert int(edit) == store.history(1)[0].edit
    store.undo()
    np.testing.assert_allclose(store.pose(name, 0).values, first.values)


def test_a_preset_is_told_from_sizes_that_somebody_chose():
    assert has_preset_sizes(load_model("gavrila34"))
    assert not has_preset_sizes(load_model("gavrila34", 1.6))
    assert not has_preset_sizes(larger(load_model("gavrila34")))
    stated = replace(load_model("gavrila34"), height_sigma=STATED_HEIGHT_SIGMA)  # somebody is as tall as the preset
    assert (has_preset_sizes(stated), has_preset_proportions(stated)) == (False, True)


@pytest.mark.slow
def test_too_few_poses_are_completed_by_tracking(session, store):
    """The sample's person, from the first frame alone: other frames are tracked, and nothing is stored."""
    start = np.array(load_session(session.folder).people[0].model.neutral())
    put(session, store, f0=record(session, store, values=start, keyframe=True))
    shares = []
    with open_observer(session.cameras) as observer:

        def report(stage, share, text=""):
            shares.append(share)
            if stage != "tracking":
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            acquire_body(session, observer, 0, range(6), AcquisitionSettings(n_frames=3), report)
    assert 0 < max(shares) <= 1
    assert [row.frame for row in store.frames(session.people[0].name)] == [0]


def test_each_round_tracks_with_the_body_of_the_one_before(session, store, monkeypatch):
    """The sizes are fitted from the present body each time, and a round that fits worse is the last."""
    put(session, store, f3=record(session, store, status="good"))
    present, tracked_with, fitted_from, costs = session.people[0].model, [], [], [2.0, 1.0, 4.0, 0.0]

    def track(observer, frames, known, report):
        (body,) = {b[0].model for b in known.bodies.values()}
        tracked_with.append(body.height_m)
        return known, known

    def acquire(observer, bodies, person, placed, settings, report, seen):
        fitted_from.append(bodies[3][0].model)
        body = present.with_height(present.height_m + 0.1 * len(fitted_from))
        return Acquisition(body, (3,), (body.neutral(),), 3.0, costs[len(fitted_from) - 1], None, None)

    monkeypatch.setattr(body_acquisition, "_with_tracked", track)
    monkeypatch.setattr(body_acquisition, "acquire_from_contours", acquire)
    acquisition = acquire_body(session, None, 0, range(10), AcquisitionSettings(n_frames=2, rounds=4))
    assert tracked_with == pytest.approx([present.height_m, present.height_m + 0.1, present.height_m + 0.2])
    assert fitted_from == [present] * 3
    assert acquisition.cost_after_px == 4.0


@pytest.mark.parametrize("known", [True, False])
def test_joints_are_those_of_anatomy_unless_known_ones_were_placed(known, session, store, monkeypatch):
    settings = {"joints": {n: [0.1 * i, 0.0, 1.0] for i, n in enumerate(LIMB_JOINTS)}} if known else {}
    put(session, store, f0=record(session, store, keyframe=True, settings=settings))
    used = []
    monkeypatch.setattr(body_acquisition, "acquire_from_contours", lambda *a: used.append(a[4].priors))
    acquire_body(session, None, 0, range(1), AcquisitionSettings())
    assert used == [SizePriors() if known else SizePriors().anatomical()]


@pytest.mark.parametrize("is_measured", [True, False])
def test_a_height_that_was_measured_is_trusted_also_after_a_restart(is_measured, session, store, monkeypatch):
    put(session, store, f0=record(session, store, status="good", settings={MEASURED: is_measured}))
    used = []
    monkeypatch.setattr(body_acquisition, "acquire_from_contours", lambda *a: used.append(a[4].priors.height))
    acquire_body(session, None, 0, range(1), AcquisitionSettings())
    assert used == [HEIGHT_SIGMA if is_measured else SizePriors().height]


def test_a_run_goes_out_from_a_lost_pose_too(session, store):
    put(session, store, f0=record(session, store, status="good"), f2=record(session, store, status="lost"))
    assert sorted(posed_frames(session, 0, range(10)).bodies) == [0]
    assert sorted(posed_frames(session, 0, range(10), start=2).bodies) == [0, 2]


def test_a_round_in_which_most_frames_are_good_is_the_last(session, store, monkeypatch):
    put(session, store, f3=record(session, store, status="good"))
    found = SimpleNamespace(body=session.people[0].model, cost_before_px=3.0, cost_after_px=2.0)
    rounds = []

    def track(observer, frames, known, report):
        good = known._replace(bodies=dict.fromkeys(range(6), known.bodies[3]))
        return good, good

    monkeypatch.setattr(body_acquisition, "_with_tracked", track)
    monkeypatch.setattr(body_acquisition, "acquire_from_contours", lambda *_: rounds.append(1) or found)
    acquire_body(session, None, 0, range(10), AcquisitionSettings(n_frames=2, rounds=4))
    assert len(rounds) == 1


@pytest.mark.parametrize(("n_good", "used"), [(3, range(3)), (2, range(8))])
def test_doubtful_frames_count_where_too_few_tracked_ones_are_good(n_good, used, session, store, monkeypatch):
    """The statuses of a body of other sizes, or in the dark, are doubtful though its poses are right."""
    put(session, store, f0=record(session, store, status="good"))
    statuses = {k: "good" if k < n_good else "doubtful" if k < 8 else "lost" for k in range(10)}
    fitted, body = [], session.people[0].model

    def estimates(_, run):
        for k in run.frames:
            yield SimpleNamespace(frame=k, statuses=(statuses[k],), poses=(body.neutral(),))

    def acquire(observer, bodies, *_):
        fitted.append(sorted(bodies))
        return SimpleNamespace(body=body, is_better=False)

    monkeypatch.setattr(body_acquisition.ChamferTracker, "estimates", estimates)
    monkeypatch.setattr(body_acquisition, "acquire_from_contours", acquire)
    acquire_body(session, None, 0, range(10), AcquisitionSettings(n_frames=3))
    assert fitted == [list(used)]
