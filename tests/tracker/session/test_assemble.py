import shutil
import tomllib
import unicodedata
from dataclasses import replace
from fractions import Fraction

import cv2
import numpy as np
import pytest
from clips import SIZE, encode, encode_stamped, write_images
from new_sessions import K, assert_refused, new, noted, place, room

from tracker.body.dimensions import STATED_HEIGHT_SIGMA
from tracker.errors import CalibrationError, ModelError, RecordingError, Remedy, SessionError
from tracker.evaluation.references import placement
from tracker.footage.recording import Recording
from tracker.formats.anipose import write_calibration
from tracker.formats.trc import MarkerTable
from tracker.geometry.cameras import Camera
from tracker.session.assemble import NewSession, assemble, unfilmed_cameras
from tracker.session.row_placement import place_rows
from tracker.session.session import load_session

__all__ = ["room"]


def test_videos_go_to_the_cameras_of_their_name(room):
    session = new(room)
    assert [(c.camera.name, c.footage.name) for c in session.cameras] == [("front", "front.mp4"), ("left", "left.mp4")]
    assert (session.fps, session.n_frames, session.up) == (30.0, 9, "z")
    assert [(p.name, p.model.name, p.model.height_m) for p in session.people] == [("person", "gavrila38", 1.75)]
    with Recording(load_session(room / "s").cameras) as recording:
        assert len(recording.read(8)) == 2


def test_camera_option_goes_before_the_name(room):
    encode(room / "other.mp4", n=9)
    session = new(room, camera_paths={"left": room / "other.mp4"})
    assert [c.footage.name for c in session.cameras] == ["front.mp4", "other.mp4"]


def test_folder_of_images_beside_a_video(room):
    (room / "left.mp4").unlink()
    folder = write_images(room / "left", [f"{i}.png" for i in range(9)])
    session = new(room, videos=[room / "front.mp4", folder])
    assert [c.footage.name for c in session.cameras] == ["front.mp4", "left"]
    assert session.fps == 30.0


def test_images_alone_need_a_rate(room):
    folders = [write_images(room / name, [f"{i}.png" for i in range(9)]) for name in ("front", "left")]
    assert_refused(room, RecordingError, "no frame rate", Remedy("give_rate"), videos=folders)
    assert new(room, videos=folders, fps=25.0).fps == 25.0


def numbered(room, **names):
    for name in names:
        (room / f"{name}.mp4").unlink(missing_ok=True)
    return [
        write_images(room / camera, [f"{camera}_{i:04d}.png" for i in numbers]) for camera, numbers in names.items()
    ]


def test_images_are_paired_by_their_number(room):
    folders = numbered(room, front=range(20, 29), left=range(20, 29))
    assert new(room, videos=folders, fps=25.0).n_frames == 9


def test_image_missing_within_a_folder(room):
    folders = numbered(room, front=range(9), left=[0, 1, 2, 4, 5, 6, 7, 8])
    expected = r"camera 'left': .*left has no image with number 3, expected every number from 0 to 8"
    assert_refused(room, RecordingError, expected, videos=folders, fps=25.0)


def test_images_of_other_instants(room):
    """As many images, but the first of one camera and the last of the other are missing."""
    folders = numbered(room, front=range(9), left=range(1, 10))
    expected = r"camera 'front': .* no image with number 9, which other cameras have"
    assert_refused(room, RecordingError, expected, videos=folders, fps=25.0)
    assert new(room, videos=folders, fps=25.0, offsets={"front": 1}).n_frames == 8


def test_people_models_and_heights(room):
    session = new(room, people=["ann", "bob"], models={"bob": "gavrila22"}, heights={"ann": 1.6})
    assert [(p.name, p.model.height_m) for p in session.people] == [("ann", 1.6), ("bob", 1.75)]
    loaded = [p.model.height_sigma for p in load_session(session.folder).people]
    assert loaded == [STATED_HEIGHT_SIGMA, None]  # a height that was stated is fixed in an acquisition
    assert session.people[0].color != session.people[1].color


def test_offsets_shorten_the_session(room):
    session = new(room, offsets={"left": 2})
    assert session.n_frames == 7
    assert [c.offset for c in session.cameras] == [0, 2]


def test_fraction_of_an_offset_goes_into_the_clock(room):
    session = new(room, offsets={"left": 2.4, "front": 0.25})
    assert [(c.offset, c.clock.ahead_frames) for c in session.cameras] == [(0, -0.25), (2, -0.4)]
    assert session.n_frames == 7


def test_offset_explains_a_longer_video(room):
    encode(room / "left.mp4", n=12)
    assert new(room, offsets={"left": 3}).n_frames == 9


def test_side_files(room):
    for name in ("front", "left"):
        (room / "masks" / name).mkdir(parents=True)
        cv2.imwrite(str(room / "masks" / name / "000002.png"), np.zeros(SIZE[::-1], np.uint8))
    (room / "bg").mkdir()
    cv2.imwrite(str(room / "bg" / "front.png"), np.zeros((*SIZE[::-1], 3), np.uint8))
    encode(room / "bg" / "left.mp4", n=3)
    session = new(room, background=room / "bg", masks=room / "masks")
    assert [c.background.name for c in session.cameras] == ["front.png", "left.mp4"]
    assert [c.masks.name for c in session.cameras] == ["front", "left"]
    cv2.imwrite(str(room / "bg" / "front.png"), np.zeros((5, 5, 3), np.uint8))
    with pytest.raises(RecordingError, match=r"camera 'front'.*5x5"):
        assemble(
            NewSession(room / "t", calibration=room / "Calib.toml", videos=room.glob("*.mp4"), background=room / "bg")
        )


def test_missing_side_files(room):
    (room / "bg").mkdir()
    assert_refused(room, RecordingError, r"camera 'front': no background.*front\.png", background=room / "bg")
    assert_refused(room, RecordingError, r"camera 'front': no masks", masks=room / "bg")


def test_video_without_camera(room):
    encode(room / "top.mp4", n=9)
    videos = [room / f"{n}.mp4" for n in ("front", "left", "top")]
    expected = r"top\.mp4 belongs to no calibrated camera.*front, left"
    assert_refused(room, SessionError, expected, Remedy("name_footage", video=videos[2]), videos=videos)


def test_camera_without_video(room):
    """It is left out, unless it is asked for by name."""
    said = []
    request = NewSession(room / "s", calibration=room / "Calib.toml", videos=[room / "front.mp4"])
    session = assemble(request, said.append)
    assert [c.camera.name for c in session.cameras] == ["front"]
    assert "Cameras without footage are left out: left." in said
    assert unfilmed_cameras(request) == ["left"]
    remedy = Remedy("give_footage", camera="left")
    without = {"videos": [room / "front.mp4"], "cameras": ["front", "left"]}
    assert_refused(room, SessionError, "no video for camera left", remedy, **without)
    assert_refused(room, SessionError, r"no video for camera front, left", videos=[])


def test_two_videos_for_a_camera(room):
    write_images(room / "left", ["1.png"])
    videos = [room / "front.mp4", room / "left.mp4", room / "left"]
    assert_refused(room, SessionError, "'left' has two videos", videos=videos)


def test_one_video_for_two_cameras(room):
    paths = {"front": room / "front.mp4", "left": room / ".." / room.name / "front.mp4"}
    _, notes = noted(room, videos=[], camera_paths=paths)
    assert notes == ["Cameras 'front' and 'left' have one video: check that each has its own."]


def test_missing_video(room):
    (room / "left.mp4").unlink()
    assert_refused(room, RecordingError, r"camera 'left'.*not found")


def test_different_lengths(room):
    encode(room / "left.mp4", n=12)
    assert_refused(room, RecordingError, "'front' 9, 'left' 12", Remedy("give_frame_offset", n=9))
    assert_refused(room, RecordingError, "'front' 9, 'left' 12", offsets={"left": 1})


@pytest.mark.slow
@pytest.mark.parametrize(("longer", "offsets", "n"), [("left", {}, 9), ("front", {}, 9), ("left", {"front": 2}, 7)])
def test_frames_that_all_cameras_have(room, longer, offsets, n):
    encode(room / f"{longer}.mp4", n=12)
    assert_refused(room, RecordingError, "number of frames", Remedy("give_frame_offset", n=n), offsets=offsets)
    session, notes = noted(room, offsets=offsets, common_frames=True)
    assert session.n_frames == n
    assert [c.offset for c in session.cameras] == [offsets.get("front", 0), 0]
    assert any(f"'{longer}'" in note and f"at its end: {12 - n}" in note for note in notes)
    again = load_session(room / "s")
    assert [c.footage_frames for c in again.cameras] == [c.footage_frames for c in session.cameras]
    with Recording(again.cameras) as recording:
        assert recording.n_frames == n


def test_common_frames_of_equal_videos_leave_nothing_out(room):
    session, notes = noted(room, common_frames=True)
    assert notes == []
    assert (session.n_frames, [c.footage_frames for c in session.cameras]) == (9, [None, None])
    assert tomllib.loads((room / "s" / "session.toml").read_text())["version"] == 1


def test_common_frames_of_images_go_by_their_numbers(room):
    folders = numbered(room, front=range(20, 29), left=range(22, 32))
    session = new(room, videos=folders, fps=25.0, common_frames=True)
    assert (session.n_frames, [c.offset for c in session.cameras]) == (7, [2, 0])
    with Recording(session.cameras) as recording:
        front, left = recording.read(0)
    assert (int(front[0, 0, 1]), int(left[0, 0, 1])) == (4 * 2, 0)  # the images numbered 22


def test_numbers_without_a_common_image(room):
    folders = numbered(room, front=range(9), left=range(20, 29))
    assert_refused(room, RecordingError, "'front'", videos=folders, fps=25.0, common_frames=True)


def jittering(n=9):
    return [3000 * k + 450 * (-1) ** k + 450 for k in range(n)]


def test_jitter_is_named_and_the_rate_overrides_it(room):
    encode_stamped(room / "left.mp4", jittering())
    remedy = Remedy("give_constant_rate", fps="30")
    assert_refused(room, RecordingError, r"camera 'left'.*variable frame rate.*1[4-8]% of a frame", remedy)
    session, notes = noted(room, fps=30.0)
    assert session.n_frames == 9
    assert len(notes) == 1
    assert "camera 'left': its time stamps lie up to 1" in notes[0]


def test_small_jitter_explains_another_mean_rate(room):
    times = [3000 * k + {4: 240, 8: -150}.get(k, 0) for k in range(9)]  # up to 8% of a frame
    encode_stamped(room / "left.mp4", times)
    remedy = Remedy("give_common_rate", fps="30")
    assert_refused(room, RecordingError, r"'left' 30\.\d+ \('left': its time stamps lie up to \d% of a frame", remedy)


def test_gaps_are_named_though_the_rate_is_given(room):
    encode_stamped(room / "left.mp4", [3000 * k + 3000 * (k > 4) for k in range(9)])
    # The rate is that between the gaps, not the mean.
    assert_refused(room, RecordingError, "variable frame rate.*1 gaps", Remedy("give_constant_rate", fps="30"))
    _, notes = noted(room, fps=30.0)
    assert "1 gaps in which frames may be missing" in notes[0]


def test_a_camera_that_starts_later_by_its_stamps(room):
    encode_stamped(room / "left.mp4", [3000 * (k + 15) for k in range(9)])
    session, notes = noted(room)
    assert session.n_frames == 9
    assert "'left' 0.5 s (15 frames)" in notes[0]
    assert notes[0].endswith("offsets front=15")
    _, notes = noted(room, folder=room / "t", offsets={"front": 1})
    assert notes == []  # the user has paired them


def test_one_camera_alone_says_what_it_can_do(room):
    assert "one camera shows no depth" in noted(room, cameras=["left"])[1][0]


def test_mirrored_video_is_named(room):
    encode(room / "left.mp4", n=9, matrix=(-1, 0, 0, 1))
    _, notes = noted(room)
    assert "camera 'left': the video's display matrix mirrors" in notes[0]


@pytest.mark.parametrize(
    ("video", "expected"),
    [
        ({"rate": 25}, "'front' 30, 'left' 25"),
        ({"rate": Fraction(30000, 1001)}, r"'front' 30, 'left' 29\.97"),  # that of television
        ({"times": [0, 1, 2, 5, 6, 7, 8, 9, 10]}, "camera 'left'.*variable frame rate"),
    ],
)
def test_different_rates(room, video, expected):
    encode(room / "left.mp4", n=9, **video)
    assert_refused(room, RecordingError, expected)


def test_rate_that_overrides_what_the_videos_declare(room):
    """High-speed footage declares the rate at which it is to be played."""
    encode(room / "left.mp4", n=9, rate=25)
    session = new(room, fps=240.0)
    for at in (session, load_session(room / "s")):
        assert (at.fps, [c.declared_fps for c in at.cameras]) == (240.0, [30.0, 25.0])
    assert tomllib.loads((room / "s" / "session.toml").read_text())["version"] == 3
    table = MarkerTable(("p",), np.arange(9), np.arange(9) / 240, np.zeros((9, 1, 3)), 240.0)
    placed = place_rows(table, "TRC file", session.fps, placement(session))
    assert placed.frames.tolist() == list(range(9))  # a TRC file of the true rate is read frame by frame


def test_rate_that_the_videos_declare_is_not_stored_twice(room):
    assert [c.declared_fps for c in new(room, fps=30.0).cameras] == [None, None]
    assert tomllib.loads((room / "s" / "session.toml").read_text())["version"] == 1


def test_some_of_the_cameras(room):
    session = new(room, cameras=["left"])  # the video of the other is given and left out
    assert [c.camera.name for c in session.cameras] == ["left"]
    assert [c.camera.name for c in load_session(room / "s").cameras] == ["left"]


def test_cameras_in_another_order(room):
    assert [c.camera.name for c in new(room, cameras=["left", "front"]).cameras] == ["left", "front"]


def test_size_unlike_the_calibration(room):
    (room / "left.mp4").unlink()
    folder = write_images(room / "left", [f"{i}.png" for i in range(9)], size=(40, 24))
    assert_refused(
        room, RecordingError, "camera 'left': expected 64x48.*found 40x24", videos=[room / "front.mp4", folder]
    )


def calibrate_at(room, size):
    """Calibrate both cameras at another size of the same picture."""
    scale = np.array([size[0] / SIZE[0], size[1] / SIZE[1]])
    scaled = K * [[scale[0]], [scale[1]], [1]]
    scaled[:2, 2] += (scale - 1) / 2
    Ts = [place(i) for i in range(2)]
    rig = [Camera(name, size, scaled, np.zeros(0), T) for name, T in zip(("front", "left"), Ts, strict=True)]
    write_calibration(room / "Calib.toml", rig)


def test_a_size_that_counts_to_the_last_pixel(room):
    calibrate_at(room, (SIZE[0] - 1, SIZE[1] - 1))
    expected = "for 63x47 pixels, and the footage has 64x48: .*correct 'size' in the calibration to 64, 48"
    assert_refused(room, RecordingError, expected)


@pytest.mark.parametrize("times", [2, 3, 0.5])
def test_a_calibration_at_a_multiple_of_the_footage_is_scaled_if_told(room, times):
    calibrate_at(room, (int(times * SIZE[0]), int(times * SIZE[1])))
    assert_refused(room, RecordingError, f"a ratio of {max(times, 1 / times):g}, which is right only if")
    for source in new(room, rescale=True).cameras:
        assert source.camera.size == SIZE
        np.testing.assert_allclose(source.camera.K, K, atol=1e-9)


def test_only_whole_multiples_of_the_same_shape_are_scaled(room):
    calibrate_at(room, (2 * SIZE[0], SIZE[1]))
    assert_refused(room, RecordingError, "expected 128x48", rescale=True)
    calibrate_at(room, (SIZE[0] * 3 // 2, SIZE[1] * 3 // 2))
    assert_refused(room, RecordingError, "expected 96x72", rescale=True)


def test_a_size_written_as_height_and_width(room):
    rows = [Camera(name, SIZE[::-1], K, np.zeros(0), place(i)) for i, name in enumerate(("front", "left"))]
    write_calibration(room / "Calib.toml", rows)
    assert_refused(room, RecordingError, "its size is height and width: exchange them")


def test_names_are_equal_in_both_unicode_forms(room):
    composed, apart = (unicodedata.normalize(form, "Büro") for form in ("NFC", "NFD"))
    rig = [Camera(name, SIZE, K, np.zeros(0), place(i)) for i, name in enumerate((composed, "left"))]
    for named in (apart, composed):
        write_calibration(room / "Calib.toml", [replace(c, name=named) if c is rig[0] else c for c in rig])
        for filmed in (apart, composed):
            folder = room / f"{named == apart}{filmed == apart}"
            (folder / "bg").mkdir(parents=True)
            shutil.copy(room / "front.mp4", folder / f"{filmed}.mp4")
            cv2.imwrite(str(folder / "bg" / f"{apart}.png"), np.zeros((SIZE[1], SIZE[0], 3), np.uint8))
            cv2.imwrite(str(folder / "bg" / "left.png"), np.zeros((SIZE[1], SIZE[0], 3), np.uint8))
            request = NewSession(
                folder / "s",
                calibration=room / "Calib.toml",
                videos=[folder / f"{filmed}.mp4", room / "left.mp4"],
                background=folder / "bg",
                cameras=(apart, "left"),
                offsets={composed: 0},
                people=(apart,),
                heights={composed: 1.8},
            )
            session = assemble(request)
            assert [c.camera.name for c in session.cameras] == [composed, "left"]
            assert session.people[0].name == composed
            assert session.people[0].model.height_m == 1.8


def test_a_camera_without_a_pose_is_left_out_unless_it_is_asked_for(room):
    text = (room / "Calib.toml").read_text()
    (room / "Calib.toml").write_text(
        text + '\n[third]\nname = "third"\nsize = [64, 48]\nmatrix = [[50, 0, 32], [0, 50, 24], [0, 0, 1]]\n'
        'rotation = "null"\ntranslation = "null"\n'
    )
    encode(room / "third.mp4", n=9)
    notes = []
    videos = [room / f"{name}.mp4" for name in ("left", "front", "third")]
    request = NewSession(room / "s", calibration=room / "Calib.toml", videos=videos)
    assert len(assemble(request, note=notes.append).cameras) == 2
    assert notes[0] == "Camera 'third' is left out: the calibration has no pose for it."
    shutil.rmtree(room / "s")
    for asked in ({"cameras": ["front", "third"]}, {"camera_paths": {"third": room / "third.mp4"}}):
        assert_refused(room, SessionError, "camera 'third' is asked for, but the calibration has no pose", **asked)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "kind", "expected"),
    [
        ({"camera_paths": {"lft": "x.mp4"}}, SessionError, "unknown camera 'lft' among the footage.*front, left"),
        ({"cameras": ["left", "lft"]}, SessionError, "unknown camera 'lft' among the cameras.*front, left"),
        ({"cameras": ["left", "left"]}, SessionError, "'left' twice"),
        ({"offsets": {"lft": 1}}, SessionError, "unknown camera 'lft' among the offsets"),
        ({"offsets": {"left": -2}}, SessionError, "others an offset of 2"),
        ({"offsets": {"left": 9}}, RecordingError, "below its 9 frames, found 9; check the footage and the offsets"),
        ({"models": {"bob": "gavrila22"}}, SessionError, "unknown person 'bob' among the body models"),
        ({"heights": {"bob": 1.7}}, SessionError, "unknown person 'bob' among the heights"),
        ({"heights": 17.5}, SessionError, "height of a person of 0.6 to 2.3 metres, found 17.5"),
        ({"models": "gavrila23"}, ModelError, "gavrila22"),
        ({"units": "mm"}, CalibrationError, "found 1.41 millimetres, so that the unit is another"),
        ({"up": "q"}, SessionError, "axis that points up"),
    ],
)
def test_wrong_options(room, changes, kind, expected):
    assert_refused(room, kind, expected, **changes)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["balance_real", "walk", "two_people", "fast_arms"])
def test_footage_at_hand(data_folder, tmp_path, name):
    folder = data_folder(name)
    session = assemble(
        NewSession(
            tmp_path / "s",
            calibration=folder / "Calib.toml",
            videos=sorted(folder.glob("*.mp4")),
            background=folder / "background",
            masks=folder / "masks" if (folder / "masks").exists() else None,
        )
    )
    assert len(session.cameras) == 4
    assert session.fps in (30.0, 60.0)
