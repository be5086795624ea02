"""Heads in exported pictures: found in every view, and blurred beyond recognition."""

from dataclasses import replace

import cv2
import imageio.v3 as iio
import numpy as np
import pytest
from bodies import MODELS
from command_line import SAMPLE
from stored_motions import filmed, store_motion
from true_poses import sample_with_poses

import quadrille
from tracker.body.model import PosedBody
from tracker.errors import FormatError, SessionError
from tracker.footage.camera_source import Clock
from tracker.footage.recording import Recording
from tracker.formats.joint_maps import JointMap
from tracker.formats.model_toml import load_model
from tracker.formats.pose_csv import read_pose_table
from tracker.interchange.exports import faces
from tracker.interchange.exports.datasets.dataset import write_dataset
from tracker.interchange.exports.faces import Circle, Heads, blurred, head_surface, recording_of
from tracker.interchange.exports.keypoints import project_through_lens
from tracker.interchange.exports.motion import ExportOptions, read_motion
from tracker.interchange.observations.observed import ObservationSet, ObservedPoints
from tracker.interchange.observations.stored import save_observations


@pytest.fixture
def couple(tmp_path):
    """Two people; ann has no pose on frames 2 and 3, and bob's is lost on frame 1."""
    models = [MODELS["gavrila38"], MODELS["gavrila22"]]
    return store_motion(tmp_path / "s", models, n_frames=5, gaps={(0, 2), (0, 3)}, lost={(1, 1)})


def is_hidden(circles, px):
    return any((np.linalg.norm(px - c.center_px, axis=1) < c.radius_px).all() for c in circles)


def test_every_head_with_a_pose_is_hidden_in_every_view(tmp_path, couple):
    session, truth = filmed(couple[0], tmp_path), couple[1]
    with recording_of(read_motion(session, (0,), [1]), "blurred") as footage:  # bob is not exported, and lost
        heads = footage._heads
    n_checked = 0
    for view, source in enumerate(session.cameras):
        circles = heads.circles(view, 1)
        for bodies in truth:
            px = project_through_lens(source.camera, head_surface(bodies[1]))
            seen = px[np.isfinite(px).all(axis=1)]
            n_checked += len(seen) > 0
            assert not len(seen) or is_hidden(circles, seen)
    assert n_checked >= 2 * len(session.cameras) - 2


def test_a_head_is_hidden_between_poses_beyond_them_and_beyond_what_is_exported(couple):
    session, truth = couple
    heads, camera = Heads(session), session.cameras[0].camera
    for frame, poses in ((2, (1, 4)), (7, (4, 4))):
        surfaces = [head_surface(truth[0][k]) for k in poses]
        between = np.average(surfaces, axis=0, weights=[4 - 2, 2 - 1])
        px = project_through_lens(camera, between)
        assert is_hidden(heads.circles(0, frame), px[np.isfinite(px).all(axis=1)])


def test_a_view_that_lags_has_the_heads_of_its_own_time(couple):
    session, truth = couple
    late = replace(session.cameras[0], clock=Clock(ahead_frames=3.0))
    heads = Heads(replace(session, cameras=(late, *session.cameras[1:])))
    px = project_through_lens(late.camera, head_surface(truth[1][3]))
    assert is_hidden(heads.circles(0, 0), px[np.isfinite(px).all(axis=1)])


def test_a_body_without_a_head_is_refused(couple, monkeypatch):
    session, _ = couple
    people = read_motion(session, (0, 1)).people
    record = people[0].poses[0]
    parts = [replace(p, name="skull") if p.name == "head" else p for p in record.body.model.parts]
    model = replace(record.body.model, parts=tuple(parts))
    headless = replace(people[0], poses={0: replace(record, body=replace(record.body, model=model))}, around={})
    monkeypatch.setattr(faces, "_stored_people", lambda _: [headless])
    with pytest.raises(SessionError, match="expected a body with a head to blur, found"):
        Heads(session)


def test_heads_of_bystanders_are_known_by_their_key_points(couple):
    session, _ = couple
    names = ("nose", "left_ear", "left_forearm", "left_ankle")
    px = np.full((5, len(session.cameras), 1, 4, 2), np.nan)
    px[3, 1, 0] = [(100, 50), (110, 52), (80, 100), (100, 250)]
    points = ObservedPoints(names, tuple(session.camera_names), px, np.isfinite(px[..., 0]).astype(float))
    joint_map = JointMap("own", {"left_ankle": "left_ankle"})
    save_observations(session, ObservationSet("d", "coco", ("ann",), joint_map, points, None, (np.arange(5.0),)), {})
    heads, bodies = Heads(session), len(Heads(session)._people)
    *_, circle = heads.circles(1, 3)
    assert len(heads.circles(0, 3)) == len(heads.circles(1, 2)) == bodies
    np.testing.assert_allclose(circle.center_px, (105, 51))
    assert 200 * 0.13 < circle.radius_px < 60


@pytest.mark.parametrize(
    ("known", "least"), [((0,), 16), ((0, 2), 16), ((2, 3), 75)], ids=["nose alone", "nose and arm", "no head"]
)
def test_a_bystander_who_is_seen_in_part_is_hidden(known, least):
    names = ("nose", "left_ear", "left_forearm", "left_ankle")
    px = np.array([(100.0, 50), (110, 52), (80, 100), (100, 250)])
    px[[i for i in range(4) if i not in known]] = np.nan
    (circle,) = faces._by_points(names, px, 0.0)
    assert circle.radius_px >= least
    assert is_hidden([circle], px[[known[0]]])


def test_a_bystander_whom_a_mask_alone_shows_is_hidden_whole(tmp_path, couple):
    session, truth = couple
    source = session.cameras[0]
    mask = np.zeros(source.camera.size[::-1], np.uint8)
    (u, v), *_ = project_through_lens(source.camera, truth[0][1].joint_centers_world[:1])
    cv2.circle(mask, (round(u), round(v)), 30, 255, -1)  # around ann's root
    cv2.rectangle(mask, (5, 5), (25, 65), 255, -1)
    cv2.imwrite(str(tmp_path / f"{1 + source.offset:06d}.png"), mask)
    session = replace(session, cameras=(replace(source, masks=tmp_path), *session.cameras[1:]))
    heads = Heads(session)
    (bystander,) = heads.circles(0, 1)[len(heads.circles(0, 0)) :]
    assert is_hidden([bystander], np.array([(5, 5), (25, 65)]))


def detail(image):
    """Energy of all that is finer than two pixels."""
    return float(np.var(cv2.Laplacian(image.astype(np.float32), cv2.CV_32F)))


def test_a_blurred_head_has_four_grains():
    noise = np.random.default_rng(0).integers(0, 255, (80, 80, 3)).astype(np.uint8)
    out = blurred(noise, [Circle(np.array([40.0, 40.0]), 30.0), Circle(np.array([-90.0, 500.0]), 30.0)])
    assert detail(out[25:55, 25:55]) < 0.01 * detail(noise[25:55, 25:55])
    np.testing.assert_array_equal(out[:8], noise[:8])


@pytest.mark.slow
def test_no_head_of_a_tracked_person_remains_sharp(tmp_path):
    """Pictures of a dataset beside the footage, around the true head."""
    session = sample_with_poses(tmp_path / "s", 10)
    table = read_pose_table(SAMPLE / "truth.csv")
    model = load_model(SAMPLE / "truth_model.toml", table.height_m)
    quadrille.export(session, tmp_path / "d", "dataset", frames=range(10), options={"faces": "blurred"})
    shares = []
    with Recording(session.cameras) as recording:
        for frame, values in enumerate(table.values_for(model)[:10]):
            surface = head_surface(PosedBody(model, values))
            for view, source in enumerate(session.cameras):
                px = project_through_lens(source.camera, surface).round().astype(int)
                (u0, v0), (u1, v1) = px.min(axis=0), px.max(axis=0)
                name = f"images/{source.camera.name}/{frame + source.offset:06d}.jpg"
                found = iio.imread(tmp_path / "d" / "recordings" / "s" / name)
                shares.append(detail(found[v0:v1, u0:u1]) / detail(recording.read_view(view, frame)[v0:v1, u0:u1]))
    assert max(shares) < 0.1
    card = (tmp_path / "d" / "README.md").read_text("utf-8")
    assert "Faces: heads are blurred" in card


def test_footage_that_is_copied_is_refused(tmp_path, couple):
    motion = read_motion(couple[0], (0, 1))
    with pytest.raises(FormatError, match="expected images with blurred faces, found video"):
        write_dataset(motion, ExportOptions(pictures="video", faces="blurred"), [tmp_path / "d"], lambda: None)
