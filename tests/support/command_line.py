"""What the tests of the command line share."""

from pathlib import Path

from tracker.session.store.annotation_store import AnnotationStore

SAMPLE = Path(__file__).resolve().parents[2] / "sample_sessions" / "elbow_rotation"
WITH_POSE = ("--method", "poses", "--poses", SAMPLE / "truth.csv")
"""Options of `init` for a true pose of the sample, which need no fit."""


def stored(session, person="person"):
    store = AnnotationStore(session / "annotations.sqlite", read_only=True)
    poses = {row.frame: store.pose(person, row.frame) for row in store.frames(person)}
    store.close()
    return poses


def output_of(result):
    """Standard output of a command, which succeeded."""
    status, out, err = result
    assert status == 0, err
    return out


def assert_refused(result, expected):
    """Status 1, nothing on standard output, and one sentence on standard error that holds the expected words."""
    status, out, err = result
    assert status == 1
    assert out == ""
    assert err.startswith("quadrille: ")
    assert err.count("\n") == 1
    assert "Traceback" not in err
    for words in expected:
        assert words in err, err
