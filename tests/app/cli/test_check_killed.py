"""`quadrille check --apply` killed at every write: the calibration is the old one, or the new one with its entry."""

import shutil
import subprocess
import sys
import textwrap
from dataclasses import replace

import numpy as np
import pytest
from command_line import SAMPLE

from tracker.geometry.camera_correction import N_CORRECTIONS
from tracker.pipeline.calibration_revisions import follow_history, with_corrections
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore

CORRECTION = np.zeros(N_CORRECTIONS)
CORRECTION[[1, 7, 8]] = 0.02, 0.01, 0.0005
"""FRONT is turned, late, and drifts: cameras and clocks lie in two files."""
CHILD = textwrap.dedent("""
    import os, signal, sys
    from contextlib import contextmanager
    from types import SimpleNamespace
    import numpy as np
    from app.main import main
    from tracker.pipeline import calibration_check, posed_recording
    from tracker.session.store.connection import Connection

    folder, last, left = sys.argv[1], sys.argv[2], [int(sys.argv[3])]
    correction = np.fromstring(last, sep=",")
    cameras = [SimpleNamespace(
        name=n, kinds=("rotation", "time", "drift") if n == "FRONT" else (), rivals={}, misfit_px=9.0, misfit_mm=50.0,
        gain_nats=100.0, is_seen=True, sigma=np.zeros_like(correction),
        correction=correction if n == "FRONT" else np.zeros_like(correction),
    ) for n in ("FRONT", "RIGHT", "BACK", "LEFT")]
    check = calibration_check.CalibrationCheck((0, 1, 2), tuple(cameras), {}, None)
    calibration_check.check_calibration = lambda *_: check
    calibration_check.held_out_scores = lambda *_: [(SimpleNamespace(cost=2.0), SimpleNamespace(cost=1.0))]
    posed_recording.PosedRecording.of_session = lambda *_: None

    def count():
        left[0] -= 1
        if left[0] < 0:
            os.kill(os.getpid(), signal.SIGKILL)

    def hook(event, arguments):
        names = [str(a) for a in arguments[:2] if isinstance(a, (str, bytes, os.PathLike))]
        is_write = event == "open" and any(c in str(arguments[1]) for c in "wax+")
        if (event in ("os.rename", "os.remove") or is_write) and any(folder in n for n in names):
            count()

    transaction = Connection.transaction

    @contextmanager
    def counted(self):
        count()
        with transaction(self) as db:
            yield db
        count()

    Connection.transaction = counted
    sys.addaudithook(hook)
    sys.argv = ["quadrille", "check", folder, "--apply"]
    main()
    print("left", left[0])
""")


def killed_after(folder, n_writes):
    """Run the command in a copy of the sample; returns whether it came to its end."""
    shutil.copytree(SAMPLE, folder)
    numbers = ",".join(map(str, CORRECTION))
    done = subprocess.run(
        [sys.executable, "-c", CHILD, str(folder), numbers, str(n_writes)], capture_output=True, text=True, check=False
    )
    assert done.returncode in (0, -9), done.stderr
    return done.returncode == 0


def content(session):
    return [(c.camera.T_world_camera, c.clock.ahead_frames, c.clock.rate) for c in session.cameras]


def is_same(one, other):
    return all(np.allclose(a, b, atol=1e-9) for x, y in zip(one, other, strict=True) for a, b in zip(x, y, strict=True))


@pytest.mark.slow
def test_a_killed_correction_is_whole_or_not_there(tmp_path):
    old = load_session(SAMPLE)
    corrections = np.zeros((len(old.cameras), N_CORRECTIONS))
    corrections[[c.camera.name for c in old.cameras].index("FRONT")] = CORRECTION
    before, after = content(old), content(with_corrections(replace(old), corrections))
    states = []
    for n in range(100):
        folder = tmp_path / str(n)
        is_done = killed_after(folder, n)
        with AnnotationStore(folder / "annotations.sqlite") as store:
            found = content(follow_history(load_session(folder), store))
            labels = [e.label for e in store.history()]
        is_new = is_same(found, after)
        assert is_new or is_same(found, before), n
        assert labels == (["calibration of FRONT corrected"] if is_new else []), n
        states.append(is_new)
        if is_done:
            break
    assert is_done
    assert states[-1]
    assert not states[0]
    assert states == sorted(states)
