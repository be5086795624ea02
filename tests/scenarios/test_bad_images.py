"""Tracking continues with any images: black, damaged, empty, without the person, without a background."""

from dataclasses import replace
from typing import NamedTuple, get_args

import cv2
import numpy as np
import pytest
from tracking_runs import track

from tracker.body.motion.pose_steps import predict
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.tracking.confidence import Status
from tracker.evidence.observer import Observer
from tracker.footage.recording import Recording
from tracker.formats.pose_csv import read_pose_table
from tracker.session.session import Session
from tracker.simulate.record import Simulation, simulate

pytestmark = pytest.mark.slow

N = 6
BAD = 3
"""The frame at which something happens."""
NEAR_MM = 40.0
"""Largest mean error of the body with three good views; in the whole recording it is 10 mm."""


class Filmed(NamedTuple):
    session: Session
    frames: list
    """Images of each camera, N times (V, H, W, 3) RGB."""
    truth: np.ndarray
    """True poses, (N, n_values), of the session's own model."""


class Shown:
    """A recording of given images; None is a damaged one."""

    def __init__(self, frames):
        self.frames = frames

    def read(self, k):
        return tuple(self.frames[k])


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    """Six frames of a figure of the tracker's own parts that moves all its limbs, in four small views."""
    folder = tmp_path_factory.mktemp("filmed") / "small"
    session = simulate(folder, Simulation("exercise", 4, N, 3, (320, 240), body="model"))
    with Recording(session.cameras) as recording:
        frames = [list(recording.read(k)) for k in range(N)]
    return Filmed(session, frames, read_pose_table(folder / "truth.csv").values_for(session.people[0].model))


def follow(filmed, frames=None, cameras=None, recording=None, **options):
    """Track all frames from the true pose; return the estimates and the mean error of the body's points, mm."""
    model, cameras = filmed.session.people[0].model, cameras or filmed.session.cameras
    observer = Observer(cameras, recording or Shown(frames or filmed.frames))
    found = list(track(observer, [model], [filmed.truth[0]], range(N), TrackSettings(**options)))
    assert [f.frame for f in found] == list(range(N))
    for estimate in found:
        assert set(estimate.statuses) <= set(get_args(Status))
        assert np.isfinite(estimate.poses[0]).all()
        assert np.isfinite(estimate.covariances[0]).all()
        np.testing.assert_allclose(model.clip(estimate.poses[0]), estimate.poses[0], atol=1e-9)
    return found, np.array([off_mm(model, f.poses[0], t) for f, t in zip(found, filmed.truth, strict=True)])


def off_mm(model, values, truth):
    return 1000 * np.linalg.norm(model.points_world(values) - model.points_world(truth), axis=1).mean()


def edited(filmed, frames, views, change):
    """The images, those of some frames and views changed."""
    return [
        [change(x) if k in frames and i in views else x for i, x in enumerate(f)] for k, f in enumerate(filmed.frames)
    ]


def black(image):
    return np.zeros_like(image)


def gray(image):
    return np.full_like(image, 128)


def damaged(image):
    return None


def test_the_recording_as_it_is(filmed):
    found, off = follow(filmed)
    assert off.max() < 20
    assert "lost" not in {f.statuses[0] for f in found}
    assert not any(np.isnan(f.view_costs_px).any() for f in found)


@pytest.mark.parametrize("change", [black, damaged, gray])
def test_a_frame_of_one_view_fails(filmed, change):
    found, off = follow(filmed, edited(filmed, [BAD], [1], change))
    assert off.max() < NEAR_MM
    blind = np.array([np.isnan(f.view_costs_px) for f in found])
    assert blind[BAD, 1]
    assert blind.sum() == 1


def test_a_file_that_cannot_be_decoded(filmed, tmp_path):
    """The footage of one camera is a folder of images, of which one is truncated."""
    folder = tmp_path / "images"
    folder.mkdir()
    for k, images in enumerate(filmed.frames):
        cv2.imwrite(str(folder / f"{k}.png"), np.ascontiguousarray(images[1][..., ::-1]))
    whole = (folder / f"{BAD}.png").read_bytes()
    (folder / f"{BAD}.png").write_bytes(whole[: len(whole) // 3])
    sources = list(filmed.session.cameras)
    sources[1] = replace(sources[1], footage=folder)
    with Recording(sources) as recording:
        found, off = follow(filmed, cameras=sources, recording=recording)
    assert off.max() < NEAR_MM
    assert np.isnan(found[BAD].view_costs_px).tolist() == [False, True, False, False]


@pytest.mark.parametrize("change", [black, damaged, gray])
def test_a_frame_of_all_views_fails(filmed, change):
    """Nothing is visible: the body has its predicted pose, is marked, and is found again on the next frame."""
    found, off = follow(filmed, edited(filmed, [BAD], range(4), change))
    assert found[BAD].statuses[0] != "good"
    model = filmed.session.people[0].model
    expected = predict(model, [filmed.truth[0], *(f.poses[0] for f in found[:BAD])], TrackSettings().predict)
    assert off_mm(model, found[BAD].poses[0], expected) < 20
    assert off[BAD + 1 :].max() < NEAR_MM
    assert found[-1].statuses[0] != "lost"


@pytest.mark.parametrize("change", [black, damaged, gray])
def test_a_view_never_shows_anything(filmed, change):
    found, off = follow(filmed, edited(filmed, range(N), [2], change))
    assert off.max() < NEAR_MM
    assert all(np.isnan(f.view_costs_px).tolist() == [False, False, True, False] for f in found)


def test_one_view_alone_is_left(filmed):
    found, off = follow(filmed, edited(filmed, range(N), [0, 2, 3], damaged))
    assert off.max() < 300  # a single view hardly observes depth
    assert all(np.isfinite(f.view_costs_px).tolist() == [False, True, False, False] for f in found)


def through_window(filmed, view, region, tmp_path):
    """The same recording, one view of which is cropped to a region u0, v0, u1, v1: its images, its cameras."""
    u0, v0, u1, v1 = region
    sources = list(filmed.session.cameras)
    empty = cv2.imread(str(sources[view].background))[v0:v1, u0:u1]
    cv2.imwrite(str(tmp_path / "empty.png"), empty)
    sources[view] = replace(
        sources[view], camera=sources[view].camera.cropped(region), background=tmp_path / "empty.png"
    )
    crop = edited(filmed, range(N), [view], lambda image: np.ascontiguousarray(image[v0:v1, u0:u1]))
    return crop, sources


def bounds(filmed, view):
    """Where the person is in a view, in all frames: u0, v0, u1, v1, px."""
    model, camera = filmed.session.people[0].model, filmed.session.cameras[view].camera
    px = camera.project(np.concatenate([model.points_world(v) for v in filmed.truth]))
    return *np.floor(px.min(axis=0)).astype(int), *np.ceil(px.max(axis=0)).astype(int)


@pytest.mark.parametrize("side", ["left of", "right of"])
def test_the_person_is_outside_one_view(filmed, side, tmp_path):
    u0, _, u1, _ = bounds(filmed, 1)
    region = (0, 0, u0 - 25, 240) if side == "left of" else (u1 + 25, 0, 320, 240)
    assert region[2] - region[0] >= 32
    found, off = follow(filmed, *through_window(filmed, 1, region, tmp_path))
    assert off.max() < NEAR_MM
    assert "lost" not in {f.statuses[0] for f in found}


@pytest.mark.parametrize("view", [0, 3])
@pytest.mark.parametrize("cut", ["half", "legs", "head"])
def test_the_person_is_cut_off_at_the_border(filmed, view, cut, tmp_path):
    u0, v0, u1, v1 = bounds(filmed, view)
    u, v = (u0 + u1) // 2, (v0 + v1) // 2
    region = {"half": (0, 0, u, 240), "legs": (0, 0, 320, v), "head": (0, v, 320, 240)}[cut]
    found, off = follow(filmed, *through_window(filmed, view, region, tmp_path))
    assert off.max() < NEAR_MM
    assert "lost" not in {f.statuses[0] for f in found}


@pytest.mark.parametrize("segments", [True, False])
def test_without_background_and_masks(filmed, segments):
    bare = [replace(c, background=None, masks=None) for c in filmed.session.cameras]
    found, off = follow(filmed, cameras=bare, segments=segments)
    assert off.max() < NEAR_MM
    assert len(found) == N


def test_search_alone_survives_it_too(filmed):
    frames = edited(filmed, [1], [1], black)
    frames[2] = [None] * 4
    found, off = follow(filmed, frames, estimate="search")
    assert off.max() < 120
    assert found[2].statuses[0] != "good"
