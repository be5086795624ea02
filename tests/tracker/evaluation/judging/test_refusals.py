import pytest
from observed_people import make_session

from tracker.errors import TrackerError
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.evaluation.judging.judge import judge


def test_two_cameras_judge_nothing(tmp_path):
    session = make_session(tmp_path / "s", 5, n_views=2)
    with pytest.raises(TrackerError, match="expected three cameras or more to judge, found 2"):
        judge(session, None, "net", TrackSettings(), None)
