"""The sizes of a body in viser's panel, as a page enters them."""

import asyncio
from types import SimpleNamespace

import pytest
import viser
from viser._gui_handles import GuiEvent

from app.scene3d import body_panel
from app.scene3d.body_panel import BodyPanel
from tracker.body.dimensions import dimensions_of


@pytest.fixture
def controller(opened):
    return opened()


@pytest.fixture
def panel(controller):
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    panel = BodyPanel(server, controller)
    panel.show(controller.state)
    yield panel
    server.stop()


def enter(control, value, said=None):
    """What viser does when a page has entered a value: the control has it, then the panel hears of it."""
    control._impl.value = value
    client = SimpleNamespace(add_notification=lambda title, text, **_: said.append((title, text)))
    for heard in control._impl.update_cb:
        asyncio.run(heard(GuiEvent(client, 1, control)))


def test_sizes_that_are_entered_become_a_draft_in_metres(controller, panel):
    folder = panel._folders[0]
    enter(folder.parts["left_forearm"], (29.0, 4.1, 4.6))
    enter(folder.widths["shoulder"], 41.0)
    sizes = dimensions_of(controller.body_sizes.model(0))
    assert sizes.parts["left_forearm"].length_m == pytest.approx(0.29)
    assert sizes.parts["right_forearm"].girths_m == pytest.approx((0.041, 0.046))  # both sides alike
    assert sizes.widths_m["shoulder"] == pytest.approx(0.41)


def test_what_is_refused_is_said_and_the_control_goes_back(controller, panel):
    height, said = panel._folders[0].height, []
    before = height.value
    enter(height, 900.0, said)
    assert height.value == before
    assert said[0][0] == "Body"
    assert controller.state.draft is None


def test_a_state_from_before_does_not_take_away_what_was_just_entered(controller, panel, monkeypatch):
    run = asyncio.to_thread

    async def after_a_state(act, *values):
        panel.show(controller.state)
        await run(act, *values)

    monkeypatch.setattr(body_panel.asyncio, "to_thread", after_a_state)
    enter(panel._folders[0].height, 190.0)
    assert dimensions_of(controller.body_sizes.model(0)).height_m == pytest.approx(1.9)
