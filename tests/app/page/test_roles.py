"""Messages that shared links may send: everything that is not named is refused."""

import asyncio
import threading
import time
from typing import get_args

import pytest
from gestures import FRONT, drag, pixel_of, wait_for
from page_visits import visiting

from app.control.session import annotating
from app.control.session.annotating import Annotating
from app.messages import annotation as plan_wire
from app.messages import client as wire
from app.messages.base import Command
from app.messages.inspector import FindPeople
from app.messages.parsing import check_allowed
from app.page import socket
from app.page.inbox import MAX_HELD_UP, MAX_WAITING
from app.page.socket import PaneSocket
from app.participants.participants import Participants
from tracker.annotation.frame_choice import FrameChoice
from tracker.errors import TrackerError


def allowed(role, message, has_place=True):
    try:
        check_allowed(role, message, has_place)
    except TrackerError:
        return False
    return True


def test_unnamed_parts_are_refused():
    class Fresh(Command, frozen=True, tag="fresh"):
        """A message of a later version."""

    assert allowed("host", Fresh())
    assert allowed("annotate", Fresh())
    assert not allowed("review", Fresh())
    assert not allowed("look", Fresh())


@pytest.mark.parametrize("message", [wire.Undo(), wire.Redo(), wire.GoTo(None), wire.Save(), wire.StopRange()])
def test_no_shared_link_changes_poses_or_the_history(message):
    assert not allowed("review", message)
    assert not allowed("look", message)


def test_a_review_moves_and_marks_poses_as_reviewed():
    assert allowed("review", wire.Seek(3))
    assert allowed("review", wire.ToggleMark("reviewed"))
    assert not allowed("review", wire.ToggleMark("keyframe"))
    marks = {action: allowed("review", wire.EditRange(action, 0, 3)) for action in get_args(wire.RangeAction)}
    assert {action for action, is_allowed in marks.items() if is_allowed} == {"reviewed", "unreviewed"}


def test_a_review_decides_and_comments():
    assert allowed("review", plan_wire.DecideTask("verify", 0, 1))
    assert allowed("review", plan_wire.WriteComment("comment", 0, 1, None, "why"))
    assert not allowed("review", plan_wire.DecideTask("withdraw", 0, 1))
    assert not allowed("review", plan_wire.PlanTasks("plan", "every"))
    assert not allowed("look", plan_wire.DecideTask("verify", 0, 1))


def test_a_page_that_looks_moves_in_a_place_of_its_own_only():
    assert allowed("look", wire.ShowHistory(10))
    assert allowed("look", wire.Seek(3))
    assert not allowed("look", wire.Seek(3), has_place=False)
    assert not allowed("look", wire.ToggleMark("reviewed"))


@pytest.mark.parametrize("message", [FindPeople("start"), wire.UseClocks("nudge"), wire.EditFloor("begin")])
def test_bodies_cameras_and_floor_are_the_hosts(message):
    assert allowed("host", message)
    assert not allowed("annotate", message)


async def test_a_link_without_a_name_watches_the_host(controller):
    async with visiting(controller, role="review") as page:
        session = await page.hear("session")
        assert (session["role"], session["has_place"]) == ("look", False)
        assert (await page.hear("presence"))["link"] == "review"
        await page.send("seek", frame=3)
        assert "only look" in (await page.hear("notice"))["text"]
        await page.send("pause_3d", pause=True)
        await page.send("history", limit=5)
        await page.hear("history")
    assert controller.state.frame == 0
    assert not controller.state.pages_pausing_3d


async def test_a_reviewer_verifies_under_the_name_of_joining(opened):
    host = opened()
    drag(host, "torso", (4.0, 0.0))
    host.annotating.plan(FrameChoice(frames="0,1"), None, [], each=False)
    async with visiting(host, role="review", name=" Rita ") as page:
        assert (await page.hear("session"))["role"] == "review"
        await page.seek(1)
        await page.send("annotation", action="verify", person=0, frame=0)
        found = await page.hear("annotation", lambda m: m["tasks"] and m["tasks"][0]["state"] == "verified")
        assert (found["annotator"], found["tasks"][0]["by"]) == ("Rita", "Rita")
        await page.send("annotation", action="withdraw", person=0, frame=0)
        assert "may only look, mark" in (await page.hear("notice"))["text"]
    assert host.state.frame == 0
    wait_for(lambda: host.state.annotation.tasks[0].by == "Rita")


async def test_a_named_look_moves_without_moving_the_host_and_writes_nothing(opened):
    host = opened()
    drag(host, "torso", (4.0, 0.0))
    entries = host.history.entries(9)
    async with visiting(host, role="look", name="Lou") as page:
        await page.seek(2)
        for refused in ({"kind": "mark", "toggle": "reviewed"}, {"kind": "undo"}):
            await page.send(refused.pop("kind"), **refused)
            assert "only look" in (await page.hear("notice"))["text"]
    assert host.state.frame == 0
    assert host.history.entries(9) == entries


async def test_a_second_page_of_another_name_is_refused_by_turn(opened):
    host = opened()
    people = Participants(host)
    host.dragging.begin(1, FRONT, 0, "torso", tuple(pixel_of(host, "torso")))
    async with visiting(host, name="ben", participants=people) as page:
        (seen,) = (await page.hear("presence"))["people"]
        assert seen["is_self"], "no page of the host is open"
        u, v = pixel_of(host, "torso")
        await page.send("drag", phase="start", camera=0, person=0, point="torso", u=u, v=v, seq=1, mode="move", frame=0)
        assert "drags on frame 0" in (await page.hear("notice"))["text"]
    people.close()


async def test_a_flooding_page_is_closed(opened, monkeypatch):
    host, gate = opened(), threading.Event()
    read, done = [], []
    real = socket.parse
    monkeypatch.setattr(socket, "parse", lambda data: read.append(data) or real(data))
    monkeypatch.setattr(Annotating, "comment", lambda *_: done.append(gate.wait()))
    sent = 4 * MAX_WAITING
    async with visiting(host, role="review", name="Rita") as page:
        for _ in range(sent):
            await page.send("annotation", action="comment", person=0, frame=0, limb=None, text="again")
        while len(read) < MAX_WAITING:
            await asyncio.sleep(0.01)
        await asyncio.sleep(0.1)
        assert len(read) <= MAX_WAITING + 3, "one at work, one that waits for a place, and the first view"
        gate.set()
        with pytest.raises(AssertionError, match=r"data=1008.*more without pause"):
            await page.hear("share")
    assert len(read) <= MAX_WAITING + MAX_HELD_UP + 3
    assert len(done) < len(read) < sent


async def test_a_host_who_sends_without_pause_only_waits(opened, monkeypatch):
    host, done = opened(), []
    monkeypatch.setattr(Annotating, "comment", lambda *_: done.append(1))
    sent = MAX_WAITING + MAX_HELD_UP + 100
    async with visiting(host) as page:
        for _ in range(sent):
            await page.send("annotation", action="comment", person=0, frame=0, limb=None, text="again")
        await page.seek(3)
    assert len(done) == sent


async def test_one_participant_has_so_many_open_comments(opened, monkeypatch):
    host = opened()
    monkeypatch.setattr(annotating, "MAX_OPEN_COMMENTS", 2)
    async with visiting(host, role="review", name="Rita") as page:
        for text in "abc":
            await page.send("annotation", action="comment", person=0, frame=0, limb=None, text=text)
        assert "at most 2 open comments" in (await page.hear("notice"))["text"]
        host.annotating.comment(0, 0, None, "of the host")
        uid = next(c.row.uid for c in host.state.annotation.comments if c.row.text == "a")
        await page.send("annotation", action="resolve", uid=uid)
        await page.send("annotation", action="comment", person=0, frame=0, limb=None, text="d")
        await page.hear("annotation", lambda m: "d" in [c["text"] for c in m["comments"]])


async def test_pages_that_are_behind_are_served_one_at_a_time(opened, monkeypatch):
    host, at_once = opened(), []
    people, free = Participants(host), threading.Lock()

    def slow(*_):
        at_once.append(free.acquire(blocking=False))
        time.sleep(0.002)
        if at_once[-1]:
            free.release()

    monkeypatch.setattr(Annotating, "comment", slow)
    panes = PaneSocket(people)
    async with (
        visiting(host, role="review", name="Rita", participants=people, panes=panes) as rita,
        visiting(host, role="review", name="Sam", participants=people, panes=panes) as sam,
    ):
        for page in (rita, sam):
            for _ in range(20):
                await page.send("annotation", action="comment", person=0, frame=0, limb=None, text="again")
            await page.send("seek", frame=3)
        for page in (rita, sam):
            await page.hear("state", lambda m: m["frame"] == 3)
    people.close()
    assert len(at_once) == 40
    assert at_once.count(False) <= 2, "only messages that nothing follows are served beside others"
