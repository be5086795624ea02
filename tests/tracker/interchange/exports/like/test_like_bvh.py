"""Mended poses turn the skeleton of a BVH file; all else of it leaves as it came."""

import numpy as np
import pytest
from observed_files import write_bvh_chain
from observed_people import make_session

from tracker.body.model import PosedBody
from tracker.formats.bvh import UPRIGHT_Y, BvhFrame, write_bvh
from tracker.formats.bvh_reading import patch_bvh, read_bvh
from tracker.formats.model_toml import format_model, load_model
from tracker.interchange.exports.like.patched_files import export_patched
from tracker.interchange.observations.importing import plan_import, store_import
from tracker.interchange.observations.plans import ImportRequest
from tracker.interchange.observations.stored import load_observations
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange, PoseRecord

N = 8
EDITED = 5
UNIT_M = 0.01
LIMBS = tuple(f"{side}_{joint}" for side in ("left", "right") for joint in ("shoulder", "elbow", "hip", "knee"))
OF_FILE = {n: n for n in LIMBS} | {"left_wrist": "left_elbow_end", "right_wrist": "right_elbow_end"}


@pytest.fixture
def session(tmp_path):
    return make_session(tmp_path / "s", N)


def moved(model, scale, seed):
    """Poses near upright."""
    rng = np.random.default_rng(seed)
    return [model.retract(model.neutral(), scale * rng.normal(size=model.n_dofs)) for _ in range(N)]


def write(path, model, poses):
    write_bvh(path, model, np.stack(poses), 30.0, BvhFrame(np.eye(4), UPRIGHT_Y, 1 / UNIT_M))


def sent(session, tmp_path, poses, by_hand=lambda name: True):
    """Import `a.bvh`, store poses of which one has values of a person, and send the file back."""
    (tmp_path / "map.toml").write_text("".join(f'{key} = "{name}"\n' for key, name in OF_FILE.items()))
    request = ImportRequest(
        "mocap", (tmp_path / "a.bvh",), ("ann",), unit_m=UNIT_M, first_frame=0, joint_map=tmp_path / "map.toml"
    )
    plan = plan_import(session, request)
    assert not plan.problems, plan.problems
    store_import(session, plan)
    model = session.people[0].model
    with AnnotationStore(session.annotations_path) as annotations:
        revision = annotations.add_model_revision("ann", format_model(model))
        changes = []
        for k, values in enumerate(poses):
            hand = [k == EDITED and by_hand(name) for name in model.value_names]
            sources = tuple("manual" if own else "tracked" for own in hand)
            changes.append(PoseChange("ann", k, PoseRecord(values, sources, revision, keyframe=k == EDITED)))
        annotations.commit("Poses", changes)
    return export_patched(session, load_observations(session, "mocap"), tmp_path / "b.bvh", learn_offsets=False)


@pytest.fixture
def poses(session, tmp_path):
    """The poses of the file as it came."""
    poses = moved(session.people[0].model, 0.2, 1)
    write(tmp_path / "a.bvh", session.people[0].model, poses)
    return poses


def test_a_mended_frame_alone_is_replaced(session, poses, tmp_path):
    model = session.people[0].model
    poses[EDITED] = moved(model, 0.2, 2)[EDITED]
    done = sent(session, tmp_path, poses)
    assert (done.frames, len(done.changed)) == ((EDITED,), 1)
    before, after = ((tmp_path / name).read_bytes().splitlines(keepends=True) for name in ("a.bvh", "b.bvh"))
    assert [i for i, (a, b) in enumerate(zip(before, after, strict=True)) if a != b] == [len(before) - N + EDITED]
    table, body = read_bvh(tmp_path / "b.bvh", UNIT_M), PosedBody(model, poses[EDITED])
    truth = dict(zip(model.point_names, body.joint_centers_world, strict=True))
    off = [np.linalg.norm(table.points[EDITED, table.names.index(n)] - truth[n]) for n in LIMBS]
    assert max(off) < 1e-4
    assert done.farthest_m < 1e-4


def test_only_values_of_an_edited_arm_change(session, poses, tmp_path):
    model = session.people[0].model
    poses[EDITED] = poses[EDITED].copy()
    arm = [i for i, name in enumerate(model.value_names) if name.startswith("left_shoulder")]
    poses[EDITED][arm] += 0.3
    done = sent(session, tmp_path, poses, lambda name: name.startswith("left_shoulder"))
    before, after = (read_bvh(tmp_path / name, UNIT_M) for name in ("a.bvh", "b.bvh"))
    moves = np.abs(before.points - after.points).max(axis=(0, 2))
    assert {n for n, m in zip(before.names, moves, strict=True) if m} <= {n for n in before.names if "left_" in n}
    assert moves[before.names.index("left_elbow")] > 0.05
    assert not moves[before.names.index("left_hip")]
    row = len((tmp_path / "a.bvh").read_text().splitlines()) - N + EDITED
    words = [(tmp_path / name).read_text().splitlines()[row].split() for name in ("a.bvh", "b.bvh")]
    assert 0 < sum(a != b for a, b in zip(*words, strict=True)) <= 6  # shoulder and elbow
    assert done.farthest_m < 1e-4


def test_nothing_was_mended(session, poses, tmp_path):
    done = sent(session, tmp_path, poses, lambda name: False)
    assert not done.changed
    assert (tmp_path / "a.bvh").read_bytes() == (tmp_path / "b.bvh").read_bytes()


def test_bones_of_another_length_keep_points_apart(session, tmp_path):
    model = session.people[0].model
    shorter = load_model("gavrila38", 0.9 * model.height_m)
    write(tmp_path / "a.bvh", shorter, moved(shorter, 0.2, 1))
    poses = moved(model, 0.2, 2)
    done = sent(session, tmp_path, poses)
    table, body = read_bvh(tmp_path / "b.bvh", UNIT_M), PosedBody(model, poses[EDITED])
    truth = dict(zip(model.point_names, body.joint_centers_world, strict=True))
    places = {name: truth[key] for key, name in OF_FILE.items()}
    off = [np.linalg.norm(table.points[EDITED, table.names.index(n)] - place) for n, place in places.items()]
    assert max(off) == pytest.approx(done.farthest_m, abs=1e-4)
    assert 0.01 < done.farthest_m < 0.1


def test_bytes_beside_the_changed_numbers_stay(tmp_path):
    write_bvh_chain(tmp_path / "a.bvh")
    text = (
        (tmp_path / "a.bvh").read_text().replace("10 20 30 90 0 0 0 0 0 0 0 0\n", " 10  20 30\t90 0 0 0 0 0 0 0 0 \n\n")
    )
    (tmp_path / "a.bvh").write_bytes(text.replace("\n", "\r\n").encode())
    points = np.full((4, 3), np.nan)
    points[2] = [0.1, 0.7, 0.3]  # the knee: below the hip, instead of in front of it
    patched = patch_bvh(tmp_path / "a.bvh", UNIT_M, {1: points}, np.array([True, True, True, False]))
    before, after = (tmp_path / "a.bvh").read_bytes(), patched.data
    assert after.startswith(before[: before.rindex(b" 10  20")] + b" 10  20 30\t90 0 0 ")
    assert after.endswith(b" 0 0 0 \r\n\r\n")
    (tmp_path / "b.bvh").write_bytes(after)
    found = read_bvh(tmp_path / "b.bvh", UNIT_M).points[1]
    assert np.allclose(found[:2], read_bvh(tmp_path / "a.bvh", UNIT_M).points[1, :2])
    assert patched.farthest_m == pytest.approx(np.linalg.norm(found[2] - points[2]), abs=1e-5)


def test_a_point_that_only_others_could_move_stays(tmp_path):
    write_bvh_chain(tmp_path / "a.bvh")
    text = (tmp_path / "a.bvh").read_text()
    right = "\tJOINT RightUpLeg\n\t{\n\t\tOFFSET -10 0 0\n\t\tCHANNELS 0\n\t}\n"
    (tmp_path / "a.bvh").write_text(text.replace("}\nMOTION", f"{right}}}\nMOTION"))
    points = np.full((5, 3), np.nan)
    points[1] = [0.1, 0.3, 0.4]  # the hip: the root would move the other one, too
    patched = patch_bvh(tmp_path / "a.bvh", UNIT_M, {0: points}, np.array([False, True, True, False, True]))
    assert patched.data == (tmp_path / "a.bvh").read_bytes()
    assert patched.farthest_m == pytest.approx(0.1)
