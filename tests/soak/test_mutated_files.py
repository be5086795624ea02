"""Mutated text files: each is read or refused by one sentence, quickly and in little memory."""

import pickle
import random
import re
import socket
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from calibration_files import WRITERS, colmap, easymocap, rig_for, wildtrack
from memory import memory_mb
from mutation import json_bytes, mutated, tried
from rigs import cameras, looking

from tracker.calibration.boards.board_description import read_board
from tracker.calibration.boards.corner_detection import CornerDetector
from tracker.formats.anipose import read_calibration
from tracker.formats.calibrations.reading import read_cameras
from tracker.formats.joint_maps import guess_joint_map, read_joint_map
from tracker.formats.model_toml import format_model, load_model, parse_model
from tracker.formats.pose_csv import read_pose_table
from tracker.formats.trc import read_trc
from tracker.geometry.ground_plane import up_rotation
from tracker.session import lock
from tracker.session.row_placement import place_rows
from tracker.session.session import load_session, save_floor

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = ROOT / "sample_sessions"
MODELS = ROOT / "tracker" / "body" / "models"
MAX_S, MAX_MB = 2.0, 500.0

JOINT_MAP = 'left_shoulder = "LSHO"\nleft_wrist = "LWRA"\nneck = "C7"\n'
BOARDS = [
    b'columns = 4\nrows = 5\nboard_height = 11.0\nboard_width = 8.5\ndictionary = "DICT_4X4_1000"\nunits = "inch"\n'
    b"aruco_scale = 0.75\nsquare_size_override_cm = 5.4\ninverted = true\n",
    b'[calibration]\nboard_type = "charuco"\nboard_size = [10, 7]\nboard_marker_length = 18.75\n'
    b"board_square_side_length = 25\n",
    b'kind = "checkerboard"\ncolumns = 9\nrows = 6\nsquare_mm = 40\n',
]
LOCK = {
    "host": socket.gethostname(), "process": 999_999, "started": "12345", "since": "2025-11-01T10:00:00+00:00",
    "token": "0123456789abcdef",
}  # fmt: skip


RIG = cameras([looking(place) for place in ([4.0, 0.3, 1.5], [0.2, 3.5, 2.0])], (-0.3, 0.1, 0.001, 0.0))


def written(write):
    """Name and bytes of a file in which a program keeps cameras; EasyMocap's pair in one."""
    with TemporaryDirectory() as folder:
        path = write(Path(folder), rig_for(write, RIG))
        files = sorted(path.iterdir()) if path.is_dir() else [path]
        data = files[0].read_bytes()
        if write is easymocap:
            own = re.sub(rb"names:\n( +-.*\n)+", b"", data.partition(b"---")[2])  # the other file has them
            data = (path.parent / "intri.yml").read_bytes() + own
        elif write is colmap:  # one file of both
            data += path.with_name("images.txt").read_bytes()
        return f"{'extr_' if write is wildtrack else ''}cameras{files[0].suffix}", [data]


def shown_camera(camera):
    """What the views compute of a camera before there is any footage."""
    camera.project(np.array([[0.1, 0.2, 0.3], [1.0, 1.0, 1.0]]))
    camera.undistort_points(np.array([[1.0, 2.0]]))
    camera.scaled(0.5)


def shown_model(model):
    """What the views compute of a body; a model that was read can be written and read again."""
    again = parse_model(format_model(model), "again")
    assert again.value_names == model.value_names
    model.points_world(model.neutral())
    for part, shape in zip(model.parts, model.shapes, strict=True):
        shape.triangles(8, 8)
        bytes.fromhex(part.color.removeprefix("#"))
    assert np.isfinite(model.kinematics(model.neutral()).Ts_world_part).all()


def read_session(path):
    session = load_session(path.parent)
    assert 1 <= session.n_frames * session.fps < 1e13
    up_rotation(session.up, session.floor)
    for person in session.people:
        bytes.fromhex(person.color.removeprefix("#"))
    for source in session.cameras:
        source.footage.exists()
    save_floor(session, session.up, session.floor)


def read_own_cameras(path):
    for camera in read_calibration(path):
        shown_camera(camera)


def read_foreign(path):
    for entry in read_cameras(path).entries:
        shown_camera(entry.camera((640, 480)))


def read_model(path):
    shown_model(load_model(path))


def read_markers(path):
    table = read_trc(path)
    place_rows(table, f"TRC file {path}", 25.0)
    guess_joint_map(table.names, path.name)


def read_described_board(path):
    board = read_board(path)
    assert np.isfinite(board.corners).all()
    CornerDetector(board)


def read_lock(path):
    with lock.SessionLock(path.parent):
        pass


def sources(pattern, *folders):
    return [p.read_bytes() for folder in folders for p in sorted(folder.glob(pattern))]


KINDS = {
    "session": ("session.toml", sources("*/session.toml", SAMPLES), read_session, 4000),
    "calibration": ("calibration.toml", sources("*/calibration.toml", SAMPLES), read_own_cameras, 4000),
    **{f"calibration of {name}": (*written(write), read_foreign, 1000) for name, write in WRITERS.items()},
    "model": ("person.toml", sources("*.toml", MODELS, SAMPLES / "tango" / "models"), read_model, 4000),
    "TRC": ("truth.trc", sources("*/*.trc", SAMPLES), read_markers, 4000),
    "lock": ("lock.json", [json_bytes(LOCK)], read_lock, 4000),
    "pose table": ("truth.csv", sources("*/*.csv", SAMPLES), read_pose_table, 1000),
    "board": ("board.toml", BOARDS, read_described_board, 1000),
    "joint map": ("map.toml", [JOINT_MAP.encode()], read_joint_map, 1000),
}
"""For each kind: name of the file, examples, what reads it, and the full number of cases."""


@pytest.mark.parametrize("kind", KINDS)
def test_mutated_files_are_read_or_refused(kind, tmp_path, cases, report, monkeypatch):
    name, examples, read, full = KINDS[kind]
    monkeypatch.setattr(lock, "_WRITING_S", 0.0)  # nobody writes these locks meanwhile
    sample = SAMPLES / "elbow_rotation"
    others = [e for _, some, _, _ in KINDS.values() for e in some]
    (tmp_path / "models").mkdir()
    (tmp_path / "camera_scale.pkl").write_bytes(pickle.dumps(1.5))  # beside cameras of MVHumanNet
    wildtrack(tmp_path, [replace(RIG[0], name="cameras")])  # the other half of its lens
    for other in ("session.toml", "calibration.toml", "models/person.toml"):
        (tmp_path / other).write_bytes((sample / other).read_bytes())
    if kind == "session":  # that of the dancers names their models and cameras
        examples = [(sample / name).read_bytes()]
    rng, n = random.Random(f"mutated {kind}"), cases(full)
    failures, refused, slowest = [], 0, 0.0
    Path("/proc/self/clear_refs").write_text("5")  # the peak counts from here
    before = memory_mb("VmRSS")
    for case in range(n):
        data = mutated(rng, name, rng.choice(examples), others)
        path = tmp_path / name
        path.write_bytes(data)
        start = time.thread_time()
        refused += tried(case, lambda: read(path), failures, data)  # noqa: B023
        took = time.thread_time() - start
        slowest = max(slowest, took)
        if took > MAX_S:
            failures.append(f"case {case}: {took:.1f} s for {len(data)} bytes: {data[:100]!r}")
        del data
        path.unlink(missing_ok=True)
    grown = memory_mb("VmHWM") - before
    report(
        f"{kind}: {n} mutated files, {refused} refused, {n - refused} read, {len(failures)} failures, "
        f"slowest {slowest:.2f} s, memory {grown:.0f} MB"
    )
    assert not failures, "\n".join(failures[:10])
    assert grown < MAX_MB
    assert 0 < refused < n  # neither all are refused nor all are read
