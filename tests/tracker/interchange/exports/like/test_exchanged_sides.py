"""Key points whose sides were found exchanged go back exchanged on request, and no others."""

import pytest
from observed_files import write_coco_images, write_deeplabcut
from observed_people import BODY_25, make_session, seen, walking, write_openpose

from tracker.errors import FormatError
from tracker.formats.trc import write_trc
from tracker.interchange.exports.like.patched_files import export_patched
from tracker.interchange.observations.importing import plan_import, store_import
from tracker.interchange.observations.plans import ImportRequest
from tracker.interchange.observations.stored import load_observations

N = 12
FRAMES, VIEW = (5, 6), 2
LEGS = [
    (BODY_25.points.index(f"L{j}"), BODY_25.points.index(f"R{j}")) for j in ("Hip", "Knee", "Ankle", "Heel", "BigToe")
]


@pytest.fixture
def session(tmp_path):
    return make_session(tmp_path / "s", N)


def exchanged(points):
    out = points.copy()
    for left, right in LEGS:
        for frame in FRAMES:
            out[frame, VIEW][:, [left, right]] = points[frame, VIEW][:, [right, left]]
    return out


def imported(session, path):
    store_import(session, plan_import(session, ImportRequest("op", (path,), ("ann",))))
    return load_observations(session, "op")


def write(kind, session, folder, points):
    if kind == "openpose":
        return write_openpose(folder, session.camera_names, points)
    if kind == "coco":
        folder.mkdir()
        write_coco_images(folder / "c.json", session.camera_names, BODY_25.points, points, "scores")
        return folder / "c.json"
    for v, name in enumerate(session.camera_names):
        write_deeplabcut(folder / name, BODY_25.points, points[:, v], "csv")
    return folder


@pytest.mark.parametrize("kind", ["openpose", "coco", "dlc"])
def test_exchanged_sides_go_back_right_on_request(session, tmp_path, kind):
    points = seen(session, [walking(N)])
    points[..., 2] = 0.9
    path = write(kind, session, tmp_path / "k", exchanged(points))
    right = write(kind, session, tmp_path / "right", points)
    observations = imported(session, path)
    plain = export_patched(session, observations, tmp_path / "plain")
    assert (plain.changed, plain.exchanged) == ((), ())
    done = export_patched(session, observations, tmp_path / "back", exchange_sides=True)
    assert done.exchanged == tuple((frame, "ann", session.camera_names[VIEW]) for frame in FRAMES)
    assert len(done.changed) == (2 if kind == "openpose" else 1)
    for file in done.paths:
        wanted = right if right.is_file() else right / file.relative_to(tmp_path / "back")
        assert _numbers(file) == _numbers(wanted)


def _numbers(path):
    """The text of a file with numbers to three decimals."""
    words = path.read_text().replace(",", " ").replace("[", " ").replace("]", " ").split()
    return [round(float(w), 3) if w.replace(".", "").replace("-", "").isdigit() else w for w in words]


def test_files_in_order_stay_byte_for_byte(session, tmp_path):
    path = write_openpose(tmp_path / "k", session.camera_names, seen(session, [walking(N)]))
    done = export_patched(session, imported(session, path), tmp_path / "back", exchange_sides=True)
    assert (done.changed, done.exchanged) == ((), ())
    files = [f.relative_to(path) for f in path.rglob("*.json")]
    assert all((path / f).read_bytes() == (tmp_path / "back" / f).read_bytes() for f in files)


def test_points_in_space_have_no_sides_to_exchange(session, tmp_path):
    write_trc(tmp_path / "a.trc", BODY_25.points, walking(N), 30.0)
    with pytest.raises(FormatError, match="expected key points, in which sides can be exchanged"):
        export_patched(session, imported(session, tmp_path / "a.trc"), tmp_path / "b.trc", exchange_sides=True)
