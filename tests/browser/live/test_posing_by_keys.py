"""The joint bar and its keys on the real program: a frame is posed without a mouse; numbers, locks, copies."""

import asyncio

import pytest
import pytest_asyncio
from page_driver import command, go_to, handle_of, state_of
from page_driver import shows as shows_within
from program import visit_again

pytestmark = pytest.mark.slow


@pytest_asyncio.fixture(loop_scope="session")
async def live(tab, program):
    await visit_again(tab, program.address)
    yield tab
    assert tab.errors == []


async def shows(page, expression, timeout_s=30.0):
    await shows_within(page, expression, timeout_s)


async def select(page, joint):
    """As a user without a mouse does."""
    await page.locator("#joint-name").select_option(joint)
    await shows(page, f"quadrille.state.state.point === '{joint}'")


async def settled(page):
    """Wait until the program has taken all keys in; the last of them is on disk then."""
    before = None
    while before != (now := await page.evaluate("JSON.stringify([quadrille.state.overlay.handles])")):
        before = now
        await asyncio.sleep(0.4)
    return (await state_of(page))["state"]


async def test_a_frame_is_positioned_by_keys_alone(live):
    await go_to(live, 3)
    await live.keyboard.press("Shift+J")  # backwards from nothing: the last point, the head
    await shows(live, "quadrille.state.state.point === 'head'")
    for _ in range(5):
        await live.keyboard.press("Shift+J")
    await live.keyboard.press("J")
    await shows(live, "quadrille.state.state.point === 'left_wrist'")
    u, v = await handle_of(live, 0, "left_wrist")
    await live.keyboard.press("1")  # the view fills the grid, and is the one that steps are parallel to
    await live.keyboard.press("Shift+ArrowUp")
    for _ in range(3):
        await live.keyboard.press("ArrowRight")
    await live.keyboard.press("Control+ArrowRight")
    state = await settled(live)
    after = await handle_of(live, 0, "left_wrist")
    # 10 cm up and 3.1 cm right: so many pixels at the distance of the body, which the torso tells.
    assert state["undo"] == "nudge left wrist, frame 3"
    assert v - after[1] == pytest.approx((after[0] - u) * 10 / 3.1, rel=0.05)
    assert after[0] - u > 2
    # Then the elbow's own degree of freedom, typed in.
    await select(live, "left_elbow")
    await live.locator("#joint-name").blur()
    await command(live, "Type a value for the selected degree of freedom")
    await live.keyboard.type("40")
    await live.keyboard.press("Enter")
    await live.keyboard.press("Escape")
    await live.keyboard.press("+")
    await live.keyboard.press("-")
    await live.keyboard.press("-")
    state = await settled(live)
    model_dof = (await state_of(live))["dof"]
    assert state["dofs"][model_dof] == pytest.approx(35.0, abs=0.01)
    assert state["undo"] == "nudge left elbow extension, frame 3"
    assert state["source"] == "manual"


async def test_mirror_copy_and_reset(live):
    await go_to(live, 5)
    await command(live, "Mirror the pose left to right")
    await shows(live, "quadrille.state.state.undo === 'mirror, frame 5'")
    await command(live, "Copy the pose from the previous frame")  # nobody has posed frame 4
    await shows(live, "document.querySelector('#advice-text')?.textContent.includes('on frame 4 to copy, found none')")
    await live.locator("#copy-pose").focus()
    await live.keyboard.press("Enter")
    await live.get_by_role("menuitem", name="Keyframe 3").focus()
    await live.keyboard.press("Enter")
    await shows(live, "quadrille.state.state.undo === 'copy frame 3, frame 5'")
    await select(live, "left_wrist")
    await live.locator("#joint-name").blur()
    await command(live, "Reset the joint's limb to neutral")
    await shows(live, "quadrille.state.state.undo === 'reset left arm, frame 5'")
    assert (await state_of(live))["state"]["dofs"][(await state_of(live))["dof"]] == pytest.approx(0)


async def test_locks_hold_under_keys_and_show(live):
    await go_to(live, 7)
    await select(live, "left_elbow")
    await live.locator("#joint-name").blur()
    await live.keyboard.press("o")
    await shows(live, "quadrille.state.state.locked.length === 1")
    assert await live.locator(".dof .number-field").is_disabled()
    before = (await state_of(live))["state"]
    await live.keyboard.press("+")
    await shows(live, "document.querySelector('#advice-text')?.textContent.includes('left elbow extension is locked')")
    assert (await state_of(live))["state"]["dofs"] == before["dofs"]
    await command(live, "Lock or unlock the joint's limb")
    await shows(live, "quadrille.state.state.locked.length > 3")
    assert await live.locator("#lock-joint").get_attribute("aria-pressed") == "true"
    await command(live, "Lock or unlock the joint's limb")
    await shows(live, "quadrille.state.state.locked.length === 0")


async def test_wrong_numbers_are_refused_and_restored(live):
    await go_to(live, 9)
    await select(live, "left_elbow")
    entry = live.locator(".dof .number-field")
    for wrong in ("abc", "200", "-5", ""):
        await entry.focus()
        await entry.fill(wrong)
        await live.keyboard.press("Enter")
        assert await entry.get_attribute("aria-invalid") == "true"
        assert f"expected a number from 0 to 155 °, found “{wrong}”" in await live.locator("#advice-text").inner_text()
        await live.keyboard.press("Escape")
        assert await entry.get_attribute("aria-invalid") is None
    before = await entry.input_value()
    await entry.fill("12,5")  # a comma is a point in half of the world
    await live.keyboard.press("Enter")
    await shows(live, f"document.querySelector('.dof .number-field').value === '12.5' && '{before}' !== '12.5'")
    await shows(live, "quadrille.state.state.undo === 'set left elbow extension, frame 9'")
    await live.locator("#step-deg").fill("0")
    await live.keyboard.press("Enter")
    assert "above 0" in await live.locator("#advice-text").inner_text()
    await live.keyboard.press("Escape")
    await live.locator("#step-deg").fill("2")
    await live.keyboard.press("Enter")
    await live.reload()
    await shows(live, "window.quadrille?.state.overlay && document.querySelector('#step-deg').value === '2'", 60)
    await live.evaluate("localStorage.clear()")


@pytest.mark.parametrize("width", [1024, 1280])
async def test_the_bar_keeps_its_height_and_nothing_is_cut_off(live, width):
    await live.set_viewport_size({"width": width, "height": 720})
    for joint in ("torso", "left_shoulder", "head"):
        await select(live, joint)
        box = await live.locator("#joint-bar").bounding_box()
        assert box["height"] == (34 if width == 1280 else 52)  # a narrow one has two rows, whatever the joint
        last = await live.locator("#reset-limb").bounding_box()
        assert last["x"] + last["width"] <= width
    assert await live.evaluate("document.querySelector('#joint-bar').scrollWidth") <= width
