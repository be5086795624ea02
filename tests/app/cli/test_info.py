"""`quadrille info` on poses of a calibration that was corrected since."""

import json
from contextlib import closing

import numpy as np
from command_line import WITH_POSE

from tracker.calibration.camera_correction import N_CORRECTIONS
from tracker.pipeline.calibration_revisions import change_calibration, with_corrections
from tracker.session.session import load_session
from tracker.store.annotation_store import AnnotationStore


def test_poses_of_an_earlier_calibration_are_counted(run, session):
    for frame in (3, 4):
        assert run("init", session, *WITH_POSE, "--frame", frame)[0] == 0
    loaded = load_session(session)
    corrections = np.zeros((len(loaded.cameras), N_CORRECTIONS))
    corrections[0, 1] = 0.01  # radians
    with closing(AnnotationStore(loaded.annotations_path)) as store:
        change_calibration(loaded, store, with_corrections(loaded, corrections), "corrected")
    assert run("init", session, *WITH_POSE, "--frame", 5)[0] == 0
    status, out, _ = run("info", session, "--no-check")
    assert status == 0
    assert "3 poses, 3 keyframes, 2 of an earlier calibration\n" in out
    status, out, _ = run("info", session, "--no-check", "--json")
    assert json.loads(out)["people"][0]["earlier_calibration"] == 2
