"""Posing by drags on the real program: joint, part and torso under the cursor, turns and depth, locks."""

import asyncio

import pytest
import pytest_asyncio
from page_driver import handle_of, state_of, to_client
from page_driver import shows as shows_within
from program import visit_again


@pytest_asyncio.fixture(loop_scope="session")
async def live(tab, program):
    await visit_again(tab, program.address)
    # In a view that fills the grid a pixel of the screen is less than one of the image.
    await tab.keyboard.press("1")
    await shows(tab, "quadrille.state.filled === 0")
    yield tab
    assert tab.errors == []


async def shows(page, expression, timeout_s=30.0):
    await shows_within(page, expression, timeout_s)


async def press(page, at):
    x, y = await to_client(page, 0, *at)
    await page.mouse.move(x - 1, y)
    await page.mouse.move(x, y)
    await page.mouse.down()


async def carry(page, start, way, steps=6):
    for k in range(1, steps + 1):
        await page.mouse.move(*await to_client(page, 0, start[0] + way[0] * k / steps, start[1] + way[1] * k / steps))


async def let_go(page, label):
    """Release, and wait for the gesture to be on disk and drawn."""
    await page.mouse.up()
    await shows(page, f"quadrille.state.state.undo?.startsWith('{label}') && !quadrille.state.dragging")
    before = None
    while before != (now := await page.evaluate("JSON.stringify(quadrille.state.overlay.handles)")):
        before = now
        await asyncio.sleep(0.3)


async def handles(page):
    rows = (await state_of(page))["overlay"]["handles"]
    return {h["point"]: (h["u"], h["v"]) for h in rows if h["camera"] == 0}


async def part_middle(page, name):
    """A place within a part's outline and away from the joints, and the part's index."""
    state = await state_of(page)
    index = state["session"]["people"][0]["parts"].index(name)
    await shows(page, "quadrille.state.overlay.outlines.length > 0")
    return await page.evaluate(
        """(index) => {
          const { segments, outlines } = quadrille.state.overlay;
          const o = outlines.find((one) => one.camera === 0 && one.part === index);
          let [u, v] = [0, 0];
          for (let i = o.first; i < o.first + o.count; i += 1) {
            u += segments[4 * i] / o.count;
            v += segments[4 * i + 1] / o.count;
          }
          return [u, v];
        }""",
        index,
    ), index


async def test_a_joint_ends_under_the_cursor(live):
    at = await handle_of(live, 0, "left_wrist")
    await press(live, at)
    await carry(live, at, (20, -25))
    assert "Ctrl: depth" in await live.locator(".drag-hint").inner_text()
    await let_go(live, "drag left wrist")
    assert await live.locator(".drag-hint").is_hidden()
    assert await handle_of(live, 0, "left_wrist") == pytest.approx((at[0] + 20, at[1] - 25), abs=1)


async def test_a_part_is_marked_and_follows_by_the_place_that_was_taken(live):
    at, index = await part_middle(live, "right_calf")
    x, y = await to_client(live, 0, *at)
    await live.mouse.move(x - 1, y)
    await live.mouse.move(x, y)
    await shows(live, f"quadrille.state.hoverPart?.part === {index}")
    before = await handles(live)
    await live.mouse.down()
    await carry(live, at, (-12, -6))
    await let_go(live, "drag right calf")
    after = await handles(live)
    # The place is neither joint; it lies between knee and ankle, and so does what became of it.
    knee, ankle = (
        tuple(b - a for a, b in zip(before[n], after[n], strict=True)) for n in ("right_knee", "right_ankle")
    )
    assert min(knee[0], ankle[0]) - 2 < -12 < max(knee[0], ankle[0]) + 2
    assert before["left_ankle"] == pytest.approx(after["left_ankle"])
    assert (await state_of(live))["state"]["point"] == "right_knee"  # the joint that moves the part
    middle, _ = await part_middle(live, "right_calf")
    assert middle == pytest.approx([at[0] - 12, at[1] - 6], abs=5)


async def test_the_torso_moves_the_body_by_square_and_by_surface(live):
    before = await handles(live)
    await press(live, before["torso"])
    await carry(live, before["torso"], (10, 5))
    await let_go(live, "drag torso")
    after = await handles(live)
    assert after["torso"] == pytest.approx((before["torso"][0] + 10, before["torso"][1] + 5), abs=1)
    at = ((after["torso"][0] + 2 * after["neck"][0]) / 3, (after["torso"][1] + 2 * after["neck"][1]) / 3)
    x, y = await to_client(live, 0, *at)
    await live.mouse.move(x - 1, y)
    await live.mouse.move(x, y)
    await shows(live, "quadrille.state.hoverPart?.part === 0")
    await live.mouse.down()
    await carry(live, at, (-10, -5))
    await let_go(live, "drag torso")
    assert (await handles(live))["torso"] == pytest.approx(before["torso"], abs=1)


async def test_shift_turns_and_control_pushes_during_a_drag(live):
    before, stood = await handles(live), (await state_of(live))["state"]["dofs"][:3]
    await press(live, before["torso"])
    await live.keyboard.down("Control")
    await carry(live, before["torso"], (0, -15))
    assert "Depth" in await live.locator(".drag-hint").inner_text()
    await live.keyboard.up("Control")
    await let_go(live, "drag torso")
    pushed = await handles(live)
    assert pushed["torso"] == pytest.approx(before["torso"], abs=1)
    moved = [b - a for a, b in zip(stood, (await state_of(live))["state"]["dofs"][:3], strict=True)]
    assert sum(x * x for x in moved) ** 0.5 > 5  # centimetres
    await press(live, pushed["torso"])
    await live.keyboard.down("Shift")
    await carry(live, pushed["torso"], (20, 0))
    assert "Turning" in await live.locator(".drag-hint").inner_text()
    await live.keyboard.up("Shift")
    await let_go(live, "drag torso")
    turned = await handles(live)
    assert turned["torso"] == pytest.approx(pushed["torso"], abs=0.5)
    assert turned["head"][0] - pushed["head"][0] > 5  # clockwise
    assert turned["left_ankle"][0] - pushed["left_ankle"][0] < -5


async def test_locks_hold_under_a_drag(live):
    await live.keyboard.press("0")
    await live.locator("#joint-name").select_option("left_shoulder")
    await live.locator("#joint-name").blur()
    await shows(live, "quadrille.state.state.point === 'left_shoulder'")
    await live.keyboard.press("o")
    await shows(live, "quadrille.state.state.locked.length === 3")
    before = await handles(live)
    dofs = (await state_of(live))["state"]["dofs"]
    locked = (await state_of(live))["state"]["locked"]
    await press(live, before["left_wrist"])
    await carry(live, before["left_wrist"], (-8, -8))
    await live.mouse.up()
    await asyncio.sleep(0.5)
    state = (await state_of(live))["state"]
    assert [state["dofs"][i] for i in locked] == [dofs[i] for i in locked]
    await press(live, before["left_elbow"])
    await carry(live, before["left_elbow"], (-8, -8))
    await live.mouse.up()
    await shows(live, "document.querySelector('#advice-text').textContent.includes('unlock')")
    assert (await handles(live))["left_elbow"] == pytest.approx(before["left_elbow"])
    await live.keyboard.press("Shift+J")  # back to the shoulder
    await shows(live, "quadrille.state.state.point === 'left_shoulder'")
    await live.keyboard.press("o")
    await shows(live, "quadrille.state.state.locked.length === 0")
