"""Messages that shared links may send: everything that is not named is refused."""

from typing import get_args

import pytest
from page_visits import visiting

from app.page import client_messages as wire
from app.page.message_parsing import check_allowed
from app.page.message_types import Command
from tracker.errors import TrackerError


def allowed(role, message):
    try:
        check_allowed(role, message)
    except TrackerError:
        return False
    return True


def test_what_is_not_named_is_refused():
    class Fresh(Command, frozen=True, tag="fresh"):
        """A message of a later version."""

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


def test_a_page_that_looks_sees_what_the_annotator_sees():
    assert allowed("look", wire.ShowHistory(10))
    assert not allowed("look", wire.Seek(3))
    assert not allowed("look", wire.ToggleMark("reviewed"))


async def test_the_program_refuses_and_goes_on(opened):
    controller = opened()
    async with visiting(controller, role="look") as page:
        assert (await page.hear("session"))["role"] == "look"
        await page.send("seek", frame=3)
        assert "only look" in (await page.hear("notice"))["text"]
        await page.send("pause_3d", pause=True)
        await page.send("history", limit=5)
        await page.hear("history")
    assert controller.state.frame == 0
    assert not controller.state.pages_pausing_3d
