"""Which joint a press takes, which joints are held, and how sides and limbs out of reach are drawn."""

import numpy as np
import pytest
from fake_endpoint import project
from page_driver import command, dragging, handle_of, shows, to_client, until

PIXELS = """(places) => {
  const canvas = document.querySelector(".pane-overlay");
  const [box, context] = [canvas.getBoundingClientRect(), canvas.getContext("2d")];
  return places.map(([x, y]) => {
    const at = [Math.round((x - box.left) * devicePixelRatio), Math.round((y - box.top) * devicePixelRatio)];
    return [...context.getImageData(...at, 1, 1).data];
  });
}"""
"""JavaScript: the colours of the first pane at places of the window."""


async def pixels(page, places):
    return np.array(await page.evaluate(PIXELS, [[float(x), float(y)] for x, y in places]))


def is_orange(colors):
    return colors[:, 0] > colors[:, 2] + 60


async def test_a_pin_belongs_to_the_joint_pressed_just_before(page, endpoint, monkeypatch):
    """The program has not answered the press yet, so that its state still has another joint selected."""
    await endpoint.tell(point="l_wrist")
    await shows(page, "quadrille.state.state.point === 'l_wrist'")

    async def unanswered(message):
        assert message["point"] == "head"

    monkeypatch.setattr(endpoint, "cast", unanswered)
    at = await to_client(page, 0, *await handle_of(page, 0, "head"))
    await page.mouse.click(*at)
    await page.keyboard.down("Control")
    await page.mouse.click(at[0] + 25, at[1])
    await page.keyboard.up("Control")
    await until(lambda: endpoint.heard("pin")[0]["point"] == "head")


@pytest.mark.endpoint(n_people=2)
async def test_the_mark_of_the_active_person_under_the_pointer_is_taken(page, endpoint):
    (u, v), active = await handle_of(page, 0, "head"), endpoint.pose[0, "head"]
    x, y = await to_client(page, 0, u, v)
    per_metre = (await to_client(page, 0, *project(active[None] + np.array([1.0, 0, 0]), 0)[0]))[0] - x
    for apart_px, person in ((4.8, 0), (5.8, 1)):
        endpoint.pose[1, "head"] = active + np.array([apart_px / per_metre, 0, 0])
        await endpoint.send_overlay()
        await shows(page, "quadrille.state.overlay.handles.filter((h) => h.camera === 0 && h.point === 'head')"
                    f".some((h) => Math.abs(quadrille.toClient(0, h.u, h.v).x - {x + apart_px}) < 0.1)")  # fmt: skip
        await page.mouse.move(x, y + 40)
        await page.mouse.move(x + apart_px, y)  # the middle of the other's mark
        await shows(page, f"quadrille.state.hover?.person === {person}")


async def test_overlapping_joints_are_both_offered(page, endpoint):
    endpoint.pose[0, "r_knee"] = endpoint.pose[0, "l_knee"] + (0.01, 0.0, 0.0)
    await endpoint.send_overlay()
    places = project(np.stack([endpoint.pose[0, "r_knee"], endpoint.pose[0, "l_knee"]]), 0)
    at = await to_client(page, 0, *places.mean(axis=0))
    await shows(page, f"quadrille.state.overlay.handles.some((h) => h.point === 'r_knee' && h.camera === 0 && "
                f"Math.abs(h.u - {places[0, 0]}) < 0.01)")  # fmt: skip
    await page.mouse.move(at[0] + 0.4, at[1])
    await shows(page, "quadrille.state.hover?.overlapping.length === 2")
    first = (await page.evaluate("quadrille.state.hover"))["point"]
    (other,) = {"l_knee", "r_knee"} - {first}
    await command(page, "Take the next of the joints that overlap under the pointer")
    await shows(page, f"quadrille.state.hover.point === '{other}'")
    await page.mouse.down()
    await page.mouse.up()
    await until(lambda: endpoint.heard("select")[-1]["point"] == other)
    # A click goes on to the next one, and so does the press after it.
    await page.mouse.down()
    await page.mouse.move(at[0] + 15, at[1])
    await page.mouse.up()
    await until(lambda: endpoint.heard("drag")[-1]["phase"] == "end")
    assert {m["point"] for m in endpoint.heard("drag")} == {first}
    # Away from the pair the nearest joint is meant again.
    await page.mouse.move(*await to_client(page, 0, *await handle_of(page, 0, "l_wrist")))
    await shows(page, "quadrille.state.hover?.point === 'l_wrist'")


async def test_a_held_joint_has_a_ring_and_is_released_by_shift_and_a_click(page, endpoint):
    x, y = await to_client(page, 0, *await handle_of(page, 0, "l_wrist"))
    ring = [(x + 8.5 * np.cos(a), y + 8.5 * np.sin(a)) for a in np.linspace(0, 2 * np.pi, 16)]
    assert np.mean(is_orange(await pixels(page, ring))) < 0.5
    await page.mouse.move(x, y)
    for held in (True, False):
        await page.keyboard.down("Shift")
        await page.mouse.down()
        await page.mouse.up()
        await page.keyboard.up("Shift")
        wanted = {"type": "pose", "action": "hold", "frame": 12, "person": 0, "point": "l_wrist", "held": held}
        await until(lambda wanted=wanted: endpoint.heard("pose")[-1] == wanted)
        held_in_page = "quadrille.state.overlay.handles.some((h) => h.point === 'l_wrist' && h.held)"
        await shows(page, held_in_page if held else f"!{held_in_page}")
        await page.wait_for_timeout(60)
        assert (np.mean(is_orange(await pixels(page, ring))) > 0.8) == held
    await command(page, "Hold the joint in place while others are dragged, or release it")
    await until(lambda: endpoint.heard("pose")[-1]["held"])
    await command(page, "Release all held joints of the person on this frame")
    await until(lambda: endpoint.heard("pose")[-1] == {**wanted, "point": None, "held": False})
    assert endpoint.heard("drag") == []


async def test_right_limbs_are_dashed_and_a_joint_out_of_reach_stays_at_the_pointer(page, endpoint):
    endpoint.sides_line = True
    await endpoint.send_overlay()
    await shows(page, "quadrille.state.overlay.paths.some((path) => path.side === 'right')")
    for side, v, is_solid in (("left", 40, True), ("right", 60, False)):
        along = [await to_client(page, 0, u, v) for u in range(110, 290, 2)]
        drawn = is_orange(await pixels(page, along))
        assert drawn.mean() > 0.4, side
        assert drawn.all() == is_solid, side
    endpoint.out_of_reach = {
        "camera": 0, "person": 0, "point": "l_wrist", "u": 560.0, "v": 60.0, "point_u": 455.0, "point_v": 155.0,
        "distance_m": 0.041,
    }  # fmt: skip
    async with dragging(page, 0, "l_wrist", (20, -20), (60, -60)):
        await shows(page, "quadrille.state.overlay.out_of_reach !== null")
        wanted, reached = await to_client(page, 0, 560, 60), await to_client(page, 0, 455, 155)
        line = np.linspace(wanted, reached, 60)[10:-10]
        assert np.mean((await pixels(page, line))[:, 0] > 200) > 0.15
        ring = [(wanted[0] + 5 * np.cos(a), wanted[1] + 5 * np.sin(a)) for a in np.linspace(0, 2 * np.pi, 12)]
        assert np.mean(is_orange(await pixels(page, ring))) > 0.6


LABEL = """async ([text, x, width]) => {
  const { drawLabel } = await import(new URL("static/panes/drawing.js", document.baseURI).href);
  const context = new OffscreenCanvas(10, 10).getContext("2d");
  const drawn = [];
  Object.assign(context, { roundRect: (...box) => drawn.push(box), fillText: (line) => drawn.push(line) });
  drawLabel(context, [text], { x, y: 50 }, width);
  return drawn;
}"""


async def test_the_label_of_a_joint_stays_within_its_pane(page):
    for x, width in ((20, 400), (380, 400), (100, 196), (190, 196)):
        box, *lines = await page.evaluate(LABEL, ["right shoulder (turns the body, held)", x, width])
        assert 0 <= box[0] <= box[0] + box[2] <= width
        assert " ".join(lines) == "right shoulder (turns the body, held)"
        assert box[1] > 60 or not box[0] <= x <= box[0] + box[2]  # not over the joint
