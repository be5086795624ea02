"""Commands of a page on a real controller."""

import time

import pytest
from gestures import PAGE

from app.control.posing import dragging
from app.control.session import session_state
from app.messages import encoding
from app.messages.client import CompareRange, EditRange
from app.messages.parsing import MessageError
from app.messages.pose import Drag, FitPose, LockDofs, Nudge, SetDof
from app.page.commands import dispatch
from tracker.errors import TrackerError


def drag_to(u, phase, seq):
    return Drag(phase=phase, frame=2, camera=0, person=0, point="left_wrist", u=u, v=240.0, seq=seq)


@pytest.fixture
def scorings(placed, monkeypatch):
    """The poses scored from now on."""
    scored, score = [], session_state.frame_cost
    monkeypatch.setattr(
        session_state, "frame_cost", lambda *args: scored.append([b.values for b in args[1]]) or score(*args)
    )
    return scored


def test_the_end_of_a_drag_scores_once(placed, scorings, monkeypatch):
    monkeypatch.setattr(dragging, "_HEAD_START_S", 0.0)
    save = placed.session_state.saver.save
    monkeypatch.setattr(placed.session_state.saver, "save", lambda *args: time.sleep(0.5) or save(*args))
    dispatch(placed, PAGE, drag_to(320.0, "start", 1))
    for seq in range(2, 6):
        dispatch(placed, PAGE, drag_to(320.0 + seq, "move", seq))
    time.sleep(0.5)  # until the background has scored the moves, and would score the next at once
    dispatch(placed, PAGE, drag_to(340.0, "end", 6))
    time.sleep(0.5)
    assert len([poses for poses in scorings if poses[0] is placed.state.poses[0]]) == 1
    assert placed.state.cost_px is not None
    assert placed.state.drag is None


@pytest.mark.parametrize(
    "message",
    [
        FitPose(frame=2, person=7),
        Nudge(frame=2, person=0, action="nudge", camera=9, right=1.0, up=0.0),
        Nudge(frame=2, person=0, action="nudge", camera=0, right=1.0, up=0.0, point="tail"),
        SetDof(frame=2, person=0, action="set", dof=999, value=1.0),
        LockDofs(frame=2, person=0, action="lock", dofs=[0, 999], locked=True),
    ],
)
def test_absent_people_and_cameras_are_refused(placed, message):
    before = placed.state
    with pytest.raises(MessageError, match=r"^expected "):
        dispatch(placed, PAGE, message)
    assert placed.state is before


def test_a_comparison_without_replaced_poses_is_refused_and_its_end_is_sent(placed):
    with pytest.raises(TrackerError, match="whose pose replaced another, found none"):
        dispatch(placed, PAGE, CompareRange(first=0, last=3))
    with pytest.raises(TrackerError, match="whose pose replaced another, found none"):
        dispatch(placed, PAGE, EditRange(action="take_replaced", first=0, last=3))
    dispatch(placed, PAGE, CompareRange(first=None, last=None))
    assert placed.state.range_comparison is None
    assert encoding.range_comparison(None).first is None
