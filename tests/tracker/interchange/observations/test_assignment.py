"""Stored poses decide who is who in key points of several people, whatever the order in which they are seen."""

import numpy as np
import pytest
from observed_people import BODY_25, make_session, seen, write_openpose

from tracker.body.model import PosedBody
from tracker.evaluation.judging import judge as judged
from tracker.formats.keypoints.detections import read_openpose
from tracker.formats.model_toml import format_model
from tracker.formats.trc import write_trc
from tracker.interchange.exports.like.patched_files import export_patched
from tracker.interchange.observations.importing import plan_import, store_import
from tracker.interchange.observations.plans import ImportRequest
from tracker.interchange.observations.stored import load_observations
from tracker.pipeline.keypoint_evidence import assigned_observations, read_points
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange, PoseRecord

N = 4
EDITED = 2
AWAY_M = {"ann": (0.6, 0.5, 0.0), "ben": (-0.6, -0.5, 0.0)}


@pytest.fixture
def session(tmp_path):
    return make_session(tmp_path / "s", N, people=("ann", "ben"))


def bodies(session, name, moved=(0.0, 0.0, 0.0)):
    """A person who walks along, by frame."""
    model = next(p.model for p in session.people if p.name == name)
    upright = PosedBody(model, model.neutral())
    out = []
    for k in range(N):
        step = np.zeros(model.n_dofs)
        place = np.add(AWAY_M[name], moved)
        step[:3] = place[0] + 0.03 * k, place[1], -upright.points_world[:, 2].min()
        out.append(PosedBody(model, model.retract(model.neutral(), step)))
    return out


def points_of(body):
    names = [p if p else ("neck",) for p in BODY_25.counterparts(BODY_25.points).values()]
    model = body.model
    return np.array(
        [body.joint_centers_world[[model.point_names.index(p) for p in some]].mean(axis=0) for some in names]
    )


def imported(session, tmp_path, first="ben"):
    """Key points of both, of which one stands first in all files."""
    order = [first, *(n for n in AWAY_M if n != first)]
    motions = [np.array([points_of(b) for b in bodies(session, name)]) for name in order]
    folder = write_openpose(tmp_path / "k", session.camera_names, seen(session, motions))
    store_import(session, plan_import(session, ImportRequest("op", (folder,), ("ann", "ben"))))


def store(session, name, edited=(), moved=(0.0, 0.0, 0.0)):
    model = next(p.model for p in session.people if p.name == name)
    with AnnotationStore(session.annotations_path) as opened:
        revision = opened.add_model_revision(name, format_model(model))
        changes = []
        for k, body in enumerate(bodies(session, name, moved)):
            source = "manual" if k in edited else "tracked"
            record = PoseRecord(body.values, (source,) * len(body.values), revision, keyframe=k in edited)
            changes.append(PoseChange(name, k, record))
        opened.commit("poses", changes)


def neck_of(session, person):
    found = read_points(session, "op")[person]
    return found.joints_world[0, found.names.index("neck"), :2]


def test_stored_poses_decide_who_is_who(session, tmp_path):
    imported(session, tmp_path)
    np.testing.assert_allclose(neck_of(session, 0), AWAY_M["ben"][:2], atol=0.1)  # the order alone
    store(session, "ben")  # one person's poses suffice
    assert load_observations(session, "op").people == ("ann", "ben")
    assert assigned_observations(session, "op").people == ("ben", "ann")
    np.testing.assert_allclose(neck_of(session, 0), AWAY_M["ann"][:2], atol=0.1)
    np.testing.assert_allclose(neck_of(session, 1), AWAY_M["ben"][:2], atol=0.1)


def test_the_order_stays_where_it_is_right_or_poses_are_elsewhere(session, tmp_path):
    imported(session, tmp_path, first="ann")
    store(session, "ann", moved=(-4.0, -4.0, 0.0))  # beyond ben
    assert assigned_observations(session, "op").people == ("ann", "ben")
    store(session, "ben")
    assert assigned_observations(session, "op").people == ("ann", "ben")


def test_the_judge_tracks_people_by_these_names(session, tmp_path, monkeypatch):
    imported(session, tmp_path)
    store(session, "ann")
    tracked = []
    monkeypatch.setattr(
        judged,
        "find_and_track",
        lambda plan, opened, sink: tracked.append(load_observations(opened.session, "op").people),
    )
    judged.best_motion(session, None, "op", (0, 1), None, None)
    assert tracked == [("ben", "ann")]


def test_mended_points_are_those_of_the_right_person(session, tmp_path):
    imported(session, tmp_path)
    store(session, "ann", edited=(EDITED,), moved=(0.1, 0.0, 0.0))
    store(session, "ben")
    done = export_patched(session, load_observations(session, "op"), tmp_path / "back")
    assert done.frames == (EDITED,)
    files = [sorted((tmp_path / folder / "cam0").glob("*.json")) for folder in ("k", "back")]
    before, after = (np.array([[p.points for p in read_openpose(file)] for file in some]) for some in files)
    moved = np.nan_to_num(np.abs(after - before)[..., :2]).max(axis=(2, 3))
    assert (moved[:, 0] == 0).all()  # ben stands first
    assert moved[EDITED, 1] > 3
    assert (np.delete(moved[:, 1], EDITED) == 0).all()


def test_points_in_space_keep_the_order_of_their_files(session, tmp_path):
    names = ["neck", "left_wrist", "right_wrist", "left_ankle", "right_ankle", "left_hip", "right_hip"]
    for place, name in (("a", "ben"), ("b", "ann")):
        motion = [[b.named_points_world[n] for n in names] for b in bodies(session, name)]
        write_trc(tmp_path / f"{place}.trc", names, np.array(motion), 30.0)
    paths = (tmp_path / "a.trc", tmp_path / "b.trc")
    plan = plan_import(session, ImportRequest("op", paths, ("ann", "ben")))
    store_import(session, plan)
    store(session, "ann")
    assert assigned_observations(session, "op").people == ("ann", "ben")
