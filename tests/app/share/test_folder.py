"""`quadrille share`: what it writes, what it keeps to itself, what it refuses."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from bodies import MODELS
from command_line import assert_refused, output_of
from stored_motions import filmed, store_motion
from true_poses import sample_with_poses

from app.share import folder as folder_module
from app.share import pictures
from app.share.content import describe
from app.share.folder import is_shared_folder, share
from app.share.overlay_lines import UNITS_PER_PX, polylines, view_lines
from app.share.pictures import GRADES, Encoder
from tracker.errors import TrackerError
from tracker.interchange.exports.motion import read_motion
from tracker.session.session import Person, save_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange

LARGE = 30e6


@pytest.fixture
def couple(tmp_path, monkeypatch):
    """Two people in four frames of small pictures, one with a gap; a fisheye and lens distortion among the views."""
    monkeypatch.setattr(pictures, "GRADES", GRADES[-1:])
    models = [MODELS["gavrila22"], MODELS["gavrila34"]]
    session, _ = store_motion(tmp_path / "s", models, n_frames=4, gaps=[(1, 2)], lost=[(0, 3)])
    session = filmed(session, tmp_path)
    save_session(session)
    return session


def data_of(text):
    return json.loads(text[text.index("{") : text.rindex("}") + 1])


def test_a_folder_has_a_picture_of_each_view_and_frame(run, couple, tmp_path):
    out = tmp_path / "review"
    text = output_of(run("share", couple.folder, "--frames", "1:4", "--out", out))
    assert "1:4 in 3 views" in text
    assert sorted(p.name for p in out.iterdir()) == ["data.js", "index.html", "page.css", "page.js", "pictures"]
    data = data_of((out / "data.js").read_text("utf-8"))
    assert data["frames"] == [1, 2, 3]
    addresses = [a for view in data["pictures"] for a in view]
    assert len(addresses) == len(set(addresses)) == 9
    for view, camera in enumerate(data["cameras"]):
        picture = cv2.imread(str(out / data["pictures"][view][0]))
        assert picture.shape == (camera["height"], camera["width"], 3)
    ann, bob = data["people"]
    assert (set(ann["poses"]), set(bob["poses"])) == ({"1", "2", "3"}, {"1", "3"})
    assert (ann["poses"]["3"]["status"], ann["poses"]["1"]["keyframe"]) == ("lost", True)
    assert [[line["person"] for line in view] for view in data["lines"][1]] == [[0], [0], [0]]
    summary = json.loads(run("share", couple.folder, "--out", tmp_path / "r2", "--json")[1])
    size = sum(p.stat().st_size for p in (tmp_path / "r2").rglob("*") if p.is_file())
    assert (summary["bytes"], summary["frames"], summary["people"]) == (size, 4, ["ann", "bob"])


def test_no_login_and_no_path_of_this_machine_is_in_the_files(run, couple, tmp_path):
    with AnnotationStore(couple.annotations_path) as store:
        store.commit("Set", [PoseChange("ann", 0, store.pose("ann", 0))], author="login-of-ann")
        assert store.pose("ann", 0).author == "login-of-ann"
    for name in ("review", "review.html"):
        assert run("share", couple.folder, "--out", tmp_path / name)[0] == 0
    files = [p for p in (tmp_path / "review").rglob("*") if p.is_file()] + [tmp_path / "review.html"]
    for path in files:
        content = path.read_bytes()
        assert b"login-of-ann" not in content, path
        assert str(tmp_path).encode() not in content, path


def test_one_file_holds_all(couple, tmp_path):
    motion, out = read_motion(couple, (0, 1)), tmp_path / "review.html"
    assert share(motion, out, LARGE) == out.stat().st_size
    text = out.read_text("utf-8")
    assert text.count("data:image/webp;base64,") == 12
    assert "src=" not in text.split("<style>")[0]
    assert 'href="page.css"' not in text


def test_names_cannot_end_the_script(couple, tmp_path):
    evil = "</script><script>globalThis.hacked = 1</script><!--\u2028"
    people = tuple(replace(p, name=p.name) for p in couple.people)
    motion = read_motion(couple, (0, 1))
    motion = replace(
        motion,
        session=replace(couple, name=evil, people=people),
        people=tuple(replace(p, person=Person(evil, p.person.model, "#f2a33a")) for p in motion.people),
    )
    share(motion, tmp_path / "review.html", LARGE)
    text = (tmp_path / "review.html").read_text("utf-8")
    assert text.count("</script>") == 2
    assert "<!--" not in text
    assert "\u2028" not in text
    data = data_of(text[text.index("quadrilleShare") : text.index("</script>")])
    assert (data["session"], data["people"][1]["name"]) == (evil, evil)


@pytest.mark.slow
def test_existing_files_are_kept(run, couple, tmp_path):
    words = ("share", couple.folder, "--out")
    empty, full, shared, file = (tmp_path / name for name in ("empty", "full", "shared", "a.html"))
    empty.mkdir()
    assert run(*words, empty)[0] == 0
    full.mkdir()
    (full / "thesis.txt").write_text("years")
    for more in ((), ("--overwrite",)):
        assert_refused(run(*words, full, *more), ["expected", "full not to exist, found a folder"])
    assert [p.name for p in full.iterdir()] == ["thesis.txt"]
    assert run(*words, shared)[0] == 0
    assert_refused(run(*words, shared), ["not to exist, found a folder", "--overwrite"])
    (shared / "pictures" / "old.webp").write_bytes(b"")
    assert run(*words, shared, "--overwrite")[0] == 0
    assert not (shared / "pictures" / "old.webp").exists()
    file.write_text("mine")
    assert_refused(run(*words, file), ["found a file"])
    assert is_shared_folder(shared)
    assert_refused(run(*words, tmp_path / "no" / "x"), ["--out in a folder that exists"])
    assert_refused(run(*words, tmp_path / "x", "--frames", "2:9"), ["--frames as A:B within 0:4"])
    assert_refused(run(*words, tmp_path / "x", "--size", "0"), ["--size as megabytes above 0"])


@pytest.mark.parametrize("name", ["review", "review.html"])
def test_a_stopped_share_leaves_nothing(couple, tmp_path, name):
    def interrupt():
        raise KeyboardInterrupt

    motion, before = read_motion(couple, (0, 1)), sorted(tmp_path.iterdir())
    with pytest.raises(KeyboardInterrupt):
        share(motion, tmp_path / name, LARGE, tick=interrupt)
    assert sorted(tmp_path.iterdir()) == before


def test_a_failure_at_the_end_leaves_what_was_there(couple, tmp_path, monkeypatch):
    motion, out = read_motion(couple, (0, 1)), tmp_path / "review"
    share(motion, out, LARGE)
    before = (out / "data.js").read_bytes()
    monkeypatch.setattr(folder_module, "_write_folder", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left")))
    with pytest.raises(TrackerError, match=r"cannot write .*No space left"):
        share(motion, out, LARGE, overwrite=True)
    assert (out / "data.js").read_bytes() == before
    assert not [p for p in tmp_path.iterdir() if p.name.startswith(".review")]


@pytest.fixture
def sample(tmp_path):
    return sample_with_poses(tmp_path / "sample", 12)


@pytest.mark.slow
def test_pictures_are_as_good_as_the_size_allows(sample, tmp_path):
    motion = read_motion(sample, (0,))
    sizes = [share(motion, tmp_path / f"{limit}", 1e6 * limit) for limit in (30, 1.2, 0.6)]
    assert all(size <= 1e6 * limit for size, limit in zip(sizes, (30, 1.2, 0.6), strict=True))
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[2] > 0.4e6  # and no smaller than needed
    single = share(motion, tmp_path / "a.html", 1.2e6)
    assert 0.6e6 < single <= 1.2e6
    with pytest.raises(
        TrackerError, match=r"expected room for the pictures of 12 frames of 4 views.*share fewer frames"
    ):
        share(motion, tmp_path / "tiny", 2e5)
    assert not (tmp_path / "tiny").exists()


def test_lines_are_those_of_the_body_in_the_picture(sample):
    motion = read_motion(sample, (0,))
    encoder = Encoder(motion.session, GRADES[3])
    body = motion.people[0].body(5)
    described = describe(motion, encoder.views)
    for view, lines in zip(encoder.views, view_lines(motion, 5, encoder.views), strict=True):
        (own,) = lines
        px = view.camera.project(body.points_world)
        assert np.allclose(np.reshape(own["points"], (-1, 2)) / UNITS_PER_PX, px, atol=0.5 / UNITS_PER_PX + 1e-6)
        outline = np.concatenate([np.cumsum(np.reshape(v, (-1, 2)), axis=0) for v in own["visible"]]) / UNITS_PER_PX
        low, high = px.min(axis=0), px.max(axis=0)
        middle = (low + high) / 2
        assert (outline.min(axis=0) < middle).all()
        assert (outline.max(axis=0) > middle).all()
        assert (np.abs(outline - middle) < 0.75 * (high - low).max()).all()
    assert described["people"][0]["plots"][0]["values"][0][5] is not None
    for camera, view in zip(described["cameras"], encoder.views, strict=True):
        corner = np.array(camera["center"]) + 2 * np.array(camera["corners"][2])
        lower_right = np.array(view.camera.size) - 0.5
        assert np.allclose(view.camera.project(corner[None])[0], lower_right, atol=0.5)


def test_pieces_of_a_contour_become_few_points():
    across = np.array([(x, 10.0, x + 4, 10.0) for x in range(0, 40, 4)])
    apart = np.array([(100.0, 0.0, 100.0, 8.0)])
    found = polylines(np.vstack([across, apart]).astype(np.float32), 1.0, 0.5)
    assert found == [[0, 40, 160, 0], [400, 0, 0, 32]]
    assert polylines(across.astype(np.float32), 0.5, 0.5) == [[-1, 19, 80, 0]]  # -0.25 and 4.75 px
    assert polylines(np.zeros((0, 4), np.float32), 1.0, 0.5) == []
