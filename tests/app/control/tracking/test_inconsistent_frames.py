"""The check of all frames gives way to edits."""

from types import SimpleNamespace

import pytest
from gestures import wait_for

from app.control.tracking import inconsistent_frames


@pytest.mark.parametrize(("n_frames", "n_rests"), [(10, 0), (100, 2 * 9)])
def test_the_check_of_a_long_recording_rests_between_intervals(couple, monkeypatch, n_frames, n_rests):
    did, clock = [], iter(range(10_000))
    monkeypatch.setattr(inconsistent_frames, "_MAX_INTERVAL", 10)
    found = inconsistent_frames.InconsistentFrames(couple._session_state)
    wait_for(lambda: found._seen)
    monkeypatch.setattr(couple._session_state.saver.index, "timeline", lambda *_: dict.fromkeys(range(n_frames)))
    monkeypatch.setattr(found, "_check_interval", lambda *_: did.append("check"))
    sleeping = SimpleNamespace(monotonic=lambda: next(clock), sleep=lambda s: did.append(s))
    monkeypatch.setattr(inconsistent_frames, "time", sleeping)
    found._check(2)
    found.close()
    assert did.count("check") == 2 * n_frames // 10
    rests = [s for s in did if s != "check"]
    assert rests == n_rests * [inconsistent_frames._REST_SHARE]  # each check takes a second of this clock
