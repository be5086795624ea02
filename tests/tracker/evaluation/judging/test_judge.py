"""Judgement of imported joints by poses that are known: every kind of error is found, named, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from stored_motions import random_poses

from tracker.body.limbs import limbs
from tracker.body.model import PosedBody
from tracker.estimation.acquisition.from_keypoints import PersonObservations
from tracker.evaluation.judging.judge import judge_person
from tracker.evaluation.judging.verdicts import LIMBS
from tracker.formats.model_toml import load_model
from tracker.session.store.records import PoseRecord
from tracker.session.store.stored_poses import StoredPose

MODEL, N = load_model("gavrila38", 1.7), 24
NAMES = tuple(j for joints in LIMBS.values() for j in joints)
POINTS = [MODEL.point_names.index(n) for n in NAMES]
AT = {n: i for i, n in enumerate(NAMES)}
OTHER_SIDE = {"left": "right_", "righ": "left_"}


@pytest.fixture(scope="module")
def tracked():
    """Poses of a slow motion, with errors of 15 mm."""
    errors = np.broadcast_to(0.015**2 * np.eye(3), (len(MODEL.point_names), 3, 3))
    poses = random_poses(MODEL, N, 3)
    records = [PoseRecord(p, ("tracked",) * len(p), 1, errors=errors, limbs_lost=(0.01,) * 5) for p in poses]
    return {k: StoredPose(PosedBody(MODEL, r.values), r) for k, r in enumerate(records)}


@pytest.fixture
def joints(tracked):
    """Joints of a detector: 12 mm of noise, and hips that lie 4 cm low throughout."""
    true = np.array([t.body.joint_centers_world[POINTS] for t in tracked.values()])
    found = true + np.random.default_rng(1).normal(0.0, 0.012, true.shape)
    for k, t in tracked.items():
        for hip in ("left_hip", "right_hip"):
            part = MODEL.proximal_parts[POINTS[AT[hip]]]
            found[k, AT[hip]] -= 0.04 * t.body.kinematics.Ts_world_part[part, :3, 2]
    return found


def judged(joints, tracked):
    points = PersonObservations(
        NAMES, joints, np.empty((len(joints), 0, len(NAMES), 2)), np.empty((len(joints), 0, len(NAMES)))
    )
    return judge_person("ann", points, tracked, None, 25.0)


def doubts(judgement):
    return {(k, limb) for k, own in judgement.frames.items() for limb, v in own.items() if v.is_doubted}


def test_nothing_is_off_where_nothing_is(joints, tracked):
    judgement = judged(joints, tracked)
    assert doubts(judgement) == set()
    assert judgement.share_in_order == 1.0
    assert all(v.reason == "" for own in judgement.frames.values() for v in own.values())


def test_an_offset_throughout_is_a_sentence_and_no_doubt(joints, tracked):
    judgement = judged(joints, tracked)
    assert len(judgement.sentences) == 2
    assert "left hip off by 4 cm throughout: 4 cm down" in judgement.sentences
    assert judgement.spread_m["left_hip"] < 0.03


@pytest.mark.parametrize(
    ("turned", "sentence"),
    [
        (lambda joints: joints[..., [1, 2, 0]], "they fit with the axes z,x,y"),
        (lambda joints: 0.3048 * joints, "times 3.281 the points fit one of 1."),
        (lambda joints: joints[:, [AT[OTHER_SIDE[n[:4]] + n.split("_")[1]] for n in NAMES]], "with left for right"),
        (lambda joints: joints[:, [*range(1, len(NAMES)), 0]], "found that the "),
    ],
    ids=["axes", "unit", "sides", "names"],
)  # fmt: skip
def test_joints_that_are_read_as_others_are_a_sentence(joints, tracked, turned, sentence):
    assert any(sentence in own for own in judged(turned(joints), tracked).sentences)


@pytest.mark.parametrize("lag", [pytest.param(-3, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.slow), 5])
def test_joints_that_lag_throughout_are_a_sentence(lag):
    """A person whose limbs swing: a slow motion lags by less than its errors."""
    model, n = MODEL, 60
    rng = np.random.default_rng(4)
    swing = np.where(model.dof_is_length, 0.0, 0.6 * rng.normal(size=model.n_dofs))
    poses = [
        model.clip(model.retract(model.neutral(), np.sin(0.25 * k + np.arange(len(swing))) * swing)) for k in range(n)
    ]
    bodies = [PosedBody(model, p) for p in poses]
    records = [PoseRecord(p, ("tracked",) * len(p), 1) for p in poses]
    tracked = {k: StoredPose(b, r) for k, (b, r) in enumerate(zip(bodies, records, strict=True))}
    true = np.array([b.joint_centers_world[POINTS] for b in bodies])
    found = true + rng.normal(0.0, 0.03, true.shape)
    late = np.full_like(found, np.nan)
    rows = np.arange(n) - lag
    inside = (rows >= 0) & (rows < n)
    late[inside] = found[rows[inside]] + 0.05
    assert judged(found, tracked).lag_frames == 0
    judgement = judged(late, tracked)
    assert judgement.lag_frames == lag
    word = f"{abs(lag)} frames {'late' if lag > 0 else 'early'}"
    assert judgement.sentences[0] == f"all joints are {word} throughout"


def test_exchanged_legs_are_named(joints, tracked):
    for joint in ("hip", "knee", "ankle"):
        a, b = AT[f"left_{joint}"], AT[f"right_{joint}"]
        joints[5:9, [a, b]] = joints[5:9, [b, a]]
    judgement = judged(joints, tracked)
    assert doubts(judgement) == {(k, f"{side} leg") for k in range(5, 9) for side in ("left", "right")}
    assert {d.verdict.reason for d in judgement.worst[:8]} == {"legs exchanged"}
    assert judgement.share_in_order == pytest.approx(1 - 4 / N)


def test_a_jump_is_named_on_its_frame(joints, tracked):
    joints[12, AT["left_wrist"]] += (0.0, 0.2, 0.1)
    judgement = judged(joints, tracked)
    assert doubts(judgement) == {(12, "left arm")}
    assert judgement.worst[0].frame == 12
    assert "left arm jumps" in judgement.worst[0].verdict.reason


def test_a_drift_is_found_from_where_it_is_large(joints, tracked):
    joints[10:, AT["right_ankle"]] += np.linspace(0, 0.3, N - 10)[:, None] * (1.0, 0.0, 0.0)
    found = doubts(judged(joints, tracked))
    assert {limb for _, limb in found} == {"right leg"}
    assert 14 <= min(k for k, _ in found) <= 16


def test_a_tracked_limb_that_is_not_known_makes_no_verdict(joints, tracked):
    joints[12, AT["left_wrist"]] += (0.0, 0.5, 0.1)
    lost = tuple(1.0 if limb.name == "left_forearm" else 0.01 for limb in limbs(MODEL))
    unsure = {k: replace(t, record=replace(t.record, limbs_lost=lost)) for k, t in tracked.items()}
    assert judged(joints, unsure).frames[12]["left arm"].probability_off == pytest.approx(0.5)


def test_limbs_without_joints_are_left_out(joints, tracked):
    joints[3, [AT[j] for j in LIMBS["right arm"]]] = np.nan
    joints[4, AT["right_wrist"]] = np.nan
    found = judged(joints, tracked).frames
    assert "right arm" not in found[3]
    assert "right arm" in found[4]


def test_a_pose_that_was_not_assessed_has_the_usual_error(joints, tracked):
    joints[6, AT["left_wrist"]] += (0.09, 0.0, 0.0)
    first = judged(joints, tracked).frames[6]["left arm"].probability_off
    unknown = {**tracked, 6: replace(tracked[6], record=replace(tracked[6].record, errors=None))}
    assert 0.05 < first < 0.95
    assert judged(joints, unknown).frames[6]["left arm"].probability_off == pytest.approx(first)
