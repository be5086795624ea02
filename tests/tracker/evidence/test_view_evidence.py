from dataclasses import replace

import cv2
import numpy as np
import pytest
from fisheye import with_fisheye
from staging import camera_at, view_evidence

from tracker.body.model import PosedBody
from tracker.errors import RecordingError
from tracker.evidence.contours import occluding_contours
from tracker.evidence.foreground import FOREGROUND_MARGIN
from tracker.evidence.images.edge_segments import MAX_LENGTH, accept_segments, link_and_sample
from tracker.evidence.images.edges import StaticEdgeModel
from tracker.evidence.images.working_view import WorkingView, region_around, working_scale
from tracker.evidence.observer import Observer
from tracker.evidence.view_evidence import (
    ACCEPTED_SHARE,
    SCENE_SPACING_PX,
    EdgeSettings,
    default_theta_px,
    with_segments,
)
from tracker.footage.camera_source import CameraSource
from tracker.footage.image_file import UNKNOWN
from tracker.footage.recording import Recording
from tracker.geometry.cameras import Camera
from tracker.session.session import load_session


class Frames:
    """A recording with the same images at every frame; None is a damaged one."""

    def __init__(self, *images):
        self.images = images

    def read(self, k):
        return self.images

    def read_view(self, camera, k):
        return self.images[camera]


class FailingFrames:
    """A recording of frame 0 only."""

    def __init__(self, image):
        self.image, self.reads = image, []

    def read(self, k):
        self.reads.append(k)
        if k:
            raise RecordingError(f"expected frame 0, found {k}")
        return (self.image,)


def source(camera, **side_files):
    return CameraSource(camera, footage=None, **side_files)


def observe(camera, image, k=0, **side_files):
    (view,) = Observer([source(camera, **side_files)], Frames(image)).evidence(k)
    return view


def square_picture(camera, half_m=0.5):
    """A white square in the plane x = 0 on black as the camera films it, with lens distortion, and its outline in the
    world."""
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = camera.rays(np.stack([u, v], axis=-1))
    hits = camera.center_world - camera.center_world[0] * rays / rays[..., :1]
    white = np.all(np.abs(hits[..., 1:]) < half_m, axis=-1)
    t = np.linspace(-half_m, half_m, 200)
    end = np.full_like(t, half_m)
    sides = [np.stack([0 * t, y, z], axis=1) for y, z in ((t, end), (t, -end), (end, t), (-end, t))]
    return np.where(white[..., None], 255, 0).astype(np.uint8).repeat(3, axis=-1), np.concatenate(sides)


def off_square(view, outline_world):
    """Distance of each edge point from the outline as the view's own camera projects it, px."""
    px = view.camera.project(outline_world)
    return np.linalg.norm(view.points_px[:, None] - px, axis=-1).min(axis=1)


LENS = np.array([-0.1, 0.02, 0.001, -0.001])


@pytest.mark.slow
@pytest.mark.parametrize("size", [(640, 480), (1023, 771), (1920, 1080), (1080, 1920)])
@pytest.mark.parametrize("lens", [np.zeros(0), LENS, None], ids=["pinhole", "lens", "fisheye"])
def test_edges_stay_registered_through_undistortion_and_scaling(size, lens):
    camera = camera_at("c", (2.5, 0.7, 0.3), size=size, focal=0.8 * size[0])
    camera = with_fisheye(camera, 100.0) if lens is None else replace(camera, distortion=lens)
    image, outline = square_picture(camera)
    view = observe(camera, image)
    assert view.camera.is_pinhole
    assert view.distance.shape == (view.camera.height, view.camera.width)
    assert camera.width * camera.height * view.scale**2 <= 640 * 480 * 1.01
    assert view.scale == pytest.approx(view.camera.width / camera.pinhole.width, abs=1e-3)
    assert view.theta_px == pytest.approx(0.03 * max(camera.size) * view.scale, abs=0.1)
    off = off_square(view, outline)
    assert len(off) > 50
    # Smoothing rounds the four corners; everywhere else edges are where they belong.
    assert np.sort(off)[:-8].max() < 1
    assert off.mean() < 0.6


def test_no_edges_are_found_where_a_fisheye_shows_no_footage():
    """The picture repeats the border of the footage there, with an edge where the stripes end."""
    camera = with_fisheye(camera_at("c", (4, 0, 0)), 110.0)
    stripes = np.where(np.arange(640)[None, :, None] // 40 % 2, 200, 60).astype(np.uint8)
    view = observe(camera, np.broadcast_to(stripes, (480, 640, 3)).copy())
    assert len(view.points_px) > 1000
    places = (view.points_px + 0.5) / view.scale - 0.5
    assert camera.is_filmed(places.astype(float)).all()


def test_small_images_are_not_enlarged():
    assert working_scale(camera_at("c", (4, 0, 0), size=(320, 240))) == 1
    assert working_scale(camera_at("c", (4, 0, 0), size=(640, 480))) == 1
    assert working_scale(camera_at("c", (4, 0, 0), size=(1280, 960))) == pytest.approx(0.5)


def test_theta_is_a_share_of_the_longer_side():
    assert default_theta_px((640, 480)) == pytest.approx(19.2)
    assert default_theta_px((480, 640)) == pytest.approx(19.2)


def test_scene_points_are_edges_one_to_a_cell():
    camera = camera_at("c", (4, 0, 0), size=(90, 60))
    edges = np.zeros((60, 90), dtype=bool)
    edges[10, 5:80] = edges[20:50, 40] = True
    view = view_evidence(camera, edges)
    u, v = view.points_px.astype(int).T
    assert edges[v, u].all()
    cells = set(zip(u // SCENE_SPACING_PX, v // SCENE_SPACING_PX, strict=True))
    assert len(cells) == len(u)
    all_v, all_u = np.nonzero(edges)
    assert cells == set(zip(all_u // SCENE_SPACING_PX, all_v // SCENE_SPACING_PX, strict=True))


def test_a_damaged_frame_has_no_edges():
    camera = camera_at("c", (4, 0, 0))
    view = observe(camera, None)
    assert view.points_px.shape == (0, 2)
    assert len(np.unique(view.distance)) == 1


@pytest.fixture(scope="module")
def session(sample_folder):
    return load_session(sample_folder)


@pytest.fixture(scope="module")
def recording(session):
    with Recording(session.cameras) as recording:
        yield recording


def edge_share(views, masks_px):
    """Share of the edge points that lie within a mask of each view."""
    inside = [
        m[v.points_px[:, 1].astype(int), v.points_px[:, 0].astype(int)] for v, m in zip(views, masks_px, strict=True)
    ]
    return np.concatenate(inside).mean()


def person_boxes(real_frame, cameras, margin_px=60):
    """The part of each image with the person: a generous box around the fitted body's joints."""
    boxes = []
    for camera in cameras:
        px = camera.pinhole.project(real_frame.model.points_world(real_frame.values))
        left, top = np.maximum(0, px.min(axis=0).astype(int) - margin_px)
        right, bottom = px.max(axis=0).astype(int) + margin_px
        box = np.zeros((camera.height, camera.width), dtype=bool)
        box[top:bottom, left:right] = True
        boxes.append(box)
    return boxes


@pytest.mark.slow
def test_the_background_keeps_edges_to_the_person(real_frame, session, recording):
    boxes = person_boxes(real_frame, [c.camera for c in session.cameras])
    bare = Observer([replace(c, background=None) for c in session.cameras], recording).evidence(25)
    with_background = Observer(session.cameras, recording).evidence(25)
    assert edge_share(with_background, boxes) > 0.95
    assert edge_share(bare, boxes) < 0.5  # racks and bars
    for view in with_background:
        assert 200 < len(view.points_px) < 2000


@pytest.mark.slow
def test_masks_go_before_the_background(tmp_path, real_frame, session, recording):
    cameras = [c.camera for c in session.cameras]
    discs = []
    for c in cameras:
        mask = np.zeros((c.height, c.width), np.uint8)
        middle = c.project(real_frame.model.points_world(real_frame.values))[0]
        cv2.circle(mask, tuple(int(x) for x in middle), 40, 1, -1)
        (tmp_path / c.name).mkdir()
        cv2.imwrite(str(tmp_path / c.name / "000025.png"), mask)
        discs.append(mask)
    observer = Observer([replace(c, masks=tmp_path / c.camera.name) for c in session.cameras], recording)
    for view, camera, disc in zip(observer.evidence(25), cameras, discs, strict=True):
        matched = WorkingView(camera)
        inside = matched.mask(disc, matched.whole)
        outside = cv2.distanceTransform((~inside).view(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        u, v = view.points_px.astype(int).T
        assert outside[v, u].max() <= FOREGROUND_MARGIN * 640 * 1.15
        assert len(u) > 20
    # A frame without a mask falls back on the background.
    without = Observer(session.cameras, recording).evidence(24)
    for a, b in zip(observer.evidence(24), without, strict=True):
        np.testing.assert_array_equal(a.points_px, b.points_px)


def test_unknown_pixels_of_a_mask_show_neither_a_contour_nor_an_outside(tmp_path, session, recording):
    view = WorkingView(session.cameras[0].camera)
    seen = {}
    for name, rows in (("whole", slice(0)), ("before", slice(240, 300))):  # a rail stands before the person
        mask = np.zeros((480, 640), np.uint8)
        mask[100:400, 260:380] = 1
        mask[rows, 200:440] = UNKNOWN
        (tmp_path / name).mkdir()
        cv2.imwrite(str(tmp_path / name / "000025.png"), mask)
        cameras = [replace(session.cameras[0], masks=tmp_path / name), *session.cameras[1:]]
        seen[name] = Observer(cameras, recording).evidence(25)[0]
        unknown = view.mask((mask == UNKNOWN).astype(np.uint8), view.whole)
        u, v = seen[name].silhouette.points_px.astype(int).T
        assert not unknown[v, u].any()
        np.testing.assert_array_equal(seen[name].silhouette.inside, view.mask(mask, view.whole))
    whole, before = (len(seen[name].silhouette.contour.points_px) for name in ("whole", "before"))
    assert before < whole  # and no contour along the rail
    assert len(seen["before"].points_px) > len(seen["whole"].points_px)  # edges of the rail may be the person's


def test_an_empty_mask_says_that_nobody_is_there(tmp_path, session, recording):
    first = session.cameras[0]
    cv2.imwrite(str(tmp_path / "000025.png"), np.zeros((480, 640), np.uint8))
    cameras = [replace(first, masks=tmp_path), *session.cameras[1:]]
    views = Observer(cameras, recording).evidence(25)
    assert [bool(len(v.points_px)) for v in views] == [False, True, True, True]


def test_a_background_of_another_size(tmp_path, session, recording):
    cv2.imwrite(str(tmp_path / "small.png"), np.zeros((24, 32, 3), np.uint8))
    cameras = [replace(session.cameras[0], background=tmp_path / "small.png"), *session.cameras[1:]]
    with pytest.raises(RecordingError, match=r"camera 'FRONT'.*640x480.*32x24"):
        Observer(cameras, recording)


@pytest.mark.slow
def test_same_frame_twice_is_the_same(session, recording):
    observer = Observer(session.cameras, recording)
    for a, b in zip(observer.evidence(7), observer.evidence(7), strict=True):
        np.testing.assert_array_equal(a.distance, b.distance)


def test_the_matched_camera_is_the_pinhole_scaled():
    camera = Camera("c", (1920, 1080), np.array([[1500.0, 0, 960], [0, 1500, 540], [0, 0, 1]]), LENS, np.eye(4))
    view = observe(camera, np.zeros((1080, 1920, 3), np.uint8))
    expected = camera.pinhole.scaled(working_scale(camera))
    np.testing.assert_allclose(view.camera.K, expected.K)
    assert view.camera.size == expected.size


@pytest.mark.slow
def test_a_region_shows_what_the_whole_image_shows_there(real_frame, session, recording):
    observer = Observer(session.cameras, recording)
    boxes = [
        region_around(c.project(real_frame.model.points_world(real_frame.values)), 60, c.size)
        for c in observer.working_cameras
    ]
    for whole, part, (u0, v0, u1, v1) in zip(observer.evidence(25), observer.evidence(25, boxes), boxes, strict=True):
        assert part.camera.size == (u1 - u0, v1 - v0) == part.distance.shape[::-1]
        assert part.corner_px == (u0, v0)
        assert part.theta_px == whole.theta_px == default_theta_px(whole.camera.size)
        joints = real_frame.model.points_world(real_frame.values)
        np.testing.assert_allclose(part.camera.project(joints) + np.array([u0, v0]), whole.camera.project(joints))
        inner = (slice(v0 + 8, v1 - 8), slice(u0 + 8, u1 - 8))
        same = (part.distance[8:-8, 8:-8] == 0) == (whole.distance[inner] == 0)
        assert same.mean() > 0.9995
        assert (part.distance == 0).any()


def test_views_can_be_looked_at_in_part_or_whole(session, recording):
    observer = Observer(session.cameras, recording)
    views = observer.evidence(3, [(100, 50, 300, 400), None, (-500, -500, -400, -400), (600, 440, 900, 900)])
    assert [v.camera.size for v in views] == [(200, 350), (640, 480), (16, 16), (40, 40)]
    assert [v.corner_px for v in views] == [(100, 50), (0, 0), (0, 0), (600, 440)]


@pytest.mark.slow
def test_settings_say_which_edges_are_found(session, recording):
    observer = Observer(session.cameras, recording)
    for settings in (EdgeSettings(foreground=False), EdgeSettings(max_segment_px=None)):
        observer.prefetch(7, [None] * 4, edges=EdgeSettings())  # features of other settings are not used
        for found, usual in zip(observer.evidence(7, edges=settings), observer.evidence(7), strict=True):
            assert (found.silhouette is None) == (not settings.foreground)
            longest = np.diff(found.segments.firsts).max()
            assert longest > MAX_LENGTH if settings.max_segment_px is None else longest <= MAX_LENGTH
            assert (usual.silhouette is None, np.diff(usual.segments.firsts).max() > MAX_LENGTH) == (False, False)
            if not settings.foreground:
                assert np.count_nonzero(found.distance == 0) > 1.5 * np.count_nonzero(usual.distance == 0)


def test_a_frame_read_ahead_is_the_same(session, recording):
    observer = Observer(session.cameras, recording)
    expected = observer.evidence(7)
    for k in (5, 6, 7):
        observer.prefetch(k)
    for a, b in zip(observer.evidence(7), expected, strict=True):
        np.testing.assert_array_equal(a.distance, b.distance)
        np.testing.assert_array_equal(a.points_px, b.points_px)


def test_a_frame_read_ahead_is_read_once():
    frames = FailingFrames(np.zeros((480, 640, 3), np.uint8))
    observer = Observer([source(camera_at("c", (4, 0, 0)))], frames)
    observer.prefetch(0)
    observer.prefetch(0)
    observer.evidence(0)
    assert frames.reads == [0]


def same_evidence(views, others):
    for a, b in zip(views, others, strict=True):
        assert (a.corner_px, a.camera.size) == (b.corner_px, b.camera.size)
        for name in ("distance", "points_px", "normals", "accepted", "colors"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
        for mine, theirs in zip((*a.segments, *a.samples.pixels), (*b.segments, *b.samples.pixels), strict=True):
            np.testing.assert_array_equal(mine, theirs)
        assert (a.silhouette is None) == (b.silhouette is None)
        if a.silhouette is not None:
            np.testing.assert_array_equal(a.silhouette.points_px, b.silhouette.points_px)


@pytest.mark.parametrize("background", [True, False])
def test_evidence_read_ahead_equals_evidence_read_later(real_frame, monkeypatch, background, session, recording):
    cameras = session.cameras if background else [replace(c, background=None) for c in session.cameras]
    observer, linked = Observer(cameras, recording), []
    predicted = [visible_contours(real_frame, c) for c in observer.working_cameras]
    boxes = [region_around(p.reshape(-1, 2), 40, (640, 480)) for p in predicted]
    static_edges = None if background else [StaticEdgeModel(c.size) for c in observer.working_cameras]
    expected = observer.evidence(25, boxes, predicted, static_edges)
    place = "tracker.evidence.foreground.link_and_sample"
    monkeypatch.setattr(place, lambda *a: linked.append(a) or link_and_sample(*a))

    def look_ahead(regions, still):
        observer.prefetch(25, regions, still)
        observer._finder.submit(lambda: None).result()  # it has been done by now

    look_ahead(boxes, not background)
    assert len(linked) == 4
    same_evidence(observer.evidence(25, boxes, predicted, static_edges), expected)
    assert len(linked) == 4
    # With other regions, or without static edges, the features are computed again.
    look_ahead([None, *boxes[1:]], not background)
    same_evidence(observer.evidence(25, boxes, predicted, static_edges), expected)
    assert len(linked) == 4 + 4 + 1
    look_ahead(boxes, background)
    same_evidence(observer.evidence(25, boxes, predicted, static_edges), expected)
    assert len(linked) == 9 + 4 + 4


def test_a_fault_read_ahead_is_raised_when_asked_for():
    observer = Observer([source(camera_at("c", (4, 0, 0)))], FailingFrames(np.zeros((480, 640, 3), np.uint8)))
    observer.prefetch(5)
    with pytest.raises(RecordingError, match="found 5"):
        observer.evidence(5)


def visible_contours(real_frame, camera):
    seen = occluding_contours.trace([PosedBody(real_frame.model, real_frame.values)], camera)
    return seen.pieces_px[~seen.occluded]


def with_accepted_segments(view, pieces_px, threshold_px=None):
    """The view with only the segments near pieces of contour, in px of its camera."""
    threshold_px = threshold_px or ACCEPTED_SHARE * view.theta_px
    return with_segments(view, accept_segments(view.samples, pieces_px, threshold_px))


def test_only_edges_near_the_prediction_are_accepted(real_frame, session, recording):
    observer = Observer([replace(c, background=None) for c in session.cameras], recording)
    predicted = [visible_contours(real_frame, c) for c in observer.working_cameras]
    for view, pieces in zip(observer.evidence(25), predicted, strict=True):
        assert view.accepted is None
        kept = with_accepted_segments(view, pieces)
        assert len(kept.accepted) == len(view.segments.firsts) - 1
        assert 0.02 < kept.accepted.mean() < 0.5  # racks and bars are refused
        pixels = view.segments.points_px[np.repeat(kept.accepted, np.diff(view.segments.firsts))]
        u, v = pixels.astype(int).T
        on_edge = np.zeros(view.distance.shape, dtype=bool)
        on_edge[v, u] = True
        np.testing.assert_array_equal(kept.distance == 0, on_edge)
        here = {tuple(p) for p in pixels.tolist()}
        assert all(tuple(p) in here for p in kept.points_px.tolist())
        cells = [tuple(c) for c in (pixels // SCENE_SPACING_PX).astype(int).tolist()]
        assert kept.points_px.tolist() == [p for i, p in enumerate(pixels.tolist()) if cells[i] not in cells[:i]]
        assert len(kept.points_px) == len(kept.normals) > 100
        np.testing.assert_allclose(np.linalg.norm(kept.normals, axis=1), 1, rtol=1e-5)
        assert not with_accepted_segments(view, pieces, 0.1).accepted.all()


def test_evidence_of_a_region_takes_the_prediction_in_pixels_of_the_whole_image(real_frame, session, recording):
    observer = Observer([replace(c, background=None) for c in session.cameras], recording)
    predicted = [visible_contours(real_frame, c) for c in observer.working_cameras]
    boxes = [region_around(p.reshape(-1, 2), 40, (640, 480)) for p in predicted]
    at_once = observer.evidence(25, boxes, predicted)
    for view, once, pieces in zip(observer.evidence(25, boxes), at_once, predicted, strict=True):
        kept = with_accepted_segments(view, pieces - np.array([*view.corner_px, *view.corner_px], np.float32))
        np.testing.assert_array_equal(once.accepted, kept.accepted)
        np.testing.assert_array_equal(once.distance, kept.distance)
        np.testing.assert_array_equal(once.points_px, kept.points_px)
        np.testing.assert_array_equal(once.normals, kept.normals)


def test_the_silhouette_and_its_contour_are_evidence(real_frame, session, recording):
    for view in Observer(session.cameras, recording).evidence(25):
        seen = view.silhouette
        assert seen.inside.shape == view.distance.shape
        joints = np.round(view.camera.project(real_frame.model.points_world(real_frame.values))).astype(int)
        assert np.mean([seen.inside[v, u] for u, v in joints]) > 0.5  # the trousers look like a shadow of the floor
        assert len(seen.points_px) == len(seen.normals) > 100
        u, v = seen.points_px.astype(int).T
        assert (seen.distance[v, u] == 0).all()
        assert seen.distance.max() <= 2 * view.theta_px
        assert seen.trust > 0.5
    bare = Observer([replace(c, background=None) for c in session.cameras], recording).evidence(25)
    assert all(view.silhouette is None for view in bare)


@pytest.mark.slow
def test_a_broken_background_is_not_trusted(tmp_path, session, recording):
    first = session.cameras[0]
    moved = np.roll(cv2.imread(str(first.background)), 12, axis=1)
    moved[150:400, 350:450] = 255
    cv2.imwrite(str(tmp_path / "moved.png"), moved)
    cameras = [replace(first, background=tmp_path / "moved.png"), *session.cameras[1:]]
    region = (200, 60, 460, 440)
    good = Observer(session.cameras, recording).evidence(25, [region, None, None, None])[0].silhouette
    broken = Observer(cameras, recording).evidence(25, [region, None, None, None])[0].silhouette
    assert broken.trust < good.trust - 0.3


@pytest.mark.slow
def test_exposure_that_changed_is_made_up_for(tmp_path, session, recording):
    first = session.cameras[0]
    darker = (0.8 * cv2.imread(str(first.background))).astype(np.uint8)
    cv2.imwrite(str(tmp_path / "darker.png"), darker)
    cameras = [replace(first, background=tmp_path / "darker.png"), *session.cameras[1:]]
    expected = Observer(session.cameras, recording).evidence(25)[0].silhouette.inside
    found = Observer(cameras, recording).evidence(25)[0].silhouette.inside
    assert (found & expected).sum() > 0.93 * (found | expected).sum()
