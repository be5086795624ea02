"""The palette, the list of keys, and keys that hold everywhere, against `fake_endpoint`."""

import re

import pytest
from page_driver import command, shows, to_client, until


async def open_palette(page, query=""):
    await page.keyboard.press("Control+k")
    await shows(page, "document.querySelector('#palette').open")
    await page.keyboard.type(query)


async def found(page):
    return await page.locator("#palette-list li > span:first-child").all_inner_texts()


@pytest.mark.slow
async def test_a_few_letters_and_enter_do_it(page, endpoint):
    for query, message in {
        "57": {"type": "seek", "frame": 57},
        "go to frame 8": {"type": "seek", "frame": 8},
        "l elb": {"type": "select", "person": 0, "point": "l_elbow"},
        "undo": {"type": "undo"},
        "srch one": {"type": "search", "action": "step", "person": None},
        "track back": {"type": "track", "action": "backward", "until": None},
    }.items():
        endpoint.received.clear()
        await open_palette(page, query)
        await page.keyboard.press("Enter")
        await until(lambda: endpoint.heard(message["type"]) == [message])  # noqa: B023
        await page.locator("#palette").wait_for(state="hidden")


@pytest.mark.slow
async def test_layers_and_cameras_are_found_by_name(page, endpoint):
    await open_palette(page, "hidden cont")
    await page.keyboard.press("Enter")
    await shows(page, "quadrille.state.layers.shown.hidden")
    await open_palette(page, "fill back")
    await page.keyboard.press("Enter")
    await shows(page, "quadrille.state.filled === 2")


@pytest.mark.slow
async def test_it_says_why_not(page, endpoint):
    await open_palette(page, "redo")
    assert "Nothing to redo" in await page.locator("#palette-why").inner_text()
    await page.keyboard.press("Enter")
    assert await page.locator("#palette").is_visible()
    await page.locator("#palette-query").fill("clear range")
    assert await found(page) == ["Clear"]
    assert "No range is marked" in await page.locator("#palette-why").inner_text()
    await page.locator("#palette-query").fill("500")
    assert await page.locator("#palette-why").inner_text() == "The last frame is 119."
    for nowhere in ("stopwatch", "share", "qwrtz"):  # letters of several words are no answer
        await page.locator("#palette-query").fill(nowhere)
        assert f"No results for “{nowhere}”" in await page.locator("#palette-why").inner_text()
    palette = await page.locator("#palette").bounding_box()
    assert palette["height"] < 120  # no empty list
    await page.keyboard.press("Enter")
    await page.keyboard.press("Escape")
    assert not endpoint.received


@pytest.mark.slow
async def test_recent_commands_come_first_and_enter_alone_does_nothing(page, endpoint):
    await open_palette(page)
    first = await found(page)
    assert await page.locator("#palette-list [aria-selected=true]").count() == 0
    await page.keyboard.press("Enter")
    assert await page.locator("#palette").is_visible()
    assert endpoint.received == []
    await page.keyboard.press("ArrowUp")
    assert await page.locator("#palette-list > :last-child").get_attribute("aria-selected") == "true"
    await page.keyboard.type("curves")
    await page.keyboard.press("Enter")
    await shows(page, "quadrille.state.drawer !== null")
    await open_palette(page)
    again = await found(page)
    assert again[0] == "Curves"
    assert first[0] != "Curves"
    assert again[1:5] == first[:4]


SUITING = "[...document.querySelectorAll('#palette-list li')].filter((li) => li.innerText.includes('suits now'))"


@pytest.mark.slow
async def test_the_next_step_suits_the_state(page, endpoint):
    async def suiting():
        await open_palette(page)
        rows = await page.evaluate(f"{SUITING}.map((li) => li.querySelector('span').textContent)")
        first = (await found(page))[: len(rows)]
        await page.keyboard.press("Escape")
        assert rows == first  # before all others
        return rows

    assert (await suiting())[0] == "Next doubtful or lost pose by severity"
    endpoint.state["people"][0]["source"] = None
    await endpoint.broadcast(endpoint.state)
    await endpoint.broadcast({"type": "timeline", "person": None, "cells": {}, "replace": True})
    await shows(page, "Object.keys(quadrille.state.timeline).length === 0")
    assert await suiting() == ["Find people", "New session from videos and a calibration"]
    track = endpoint.state["track"] | {"running": True, "first": 12, "last": 30, "at": 15, "done": 4, "total": 18}
    await endpoint.broadcast(endpoint.state | {"track": track})
    await shows(page, "quadrille.state.state.track.running")
    assert (await suiting())[:2] == ["Pause or continue tracking", "Follow the tracker (toggle)"]
    # Commands that cannot be done now are not suggested; the one used last comes first.
    await page.keyboard.press("Control+k")
    await page.keyboard.type("messages log")
    await page.keyboard.press("Enter")
    await page.keyboard.press("Escape")
    await open_palette(page)
    assert (await found(page))[:2] == ["Earlier sentences of the line", "Pause or continue tracking"]


@pytest.mark.slow
async def test_every_suggestion_is_a_command(page):
    known = await page.evaluate(
        """async () => {
          const text = await (await fetch("/static/shell/commands.js")).text();
          const body = text.slice(text.indexOf("const cases"), text.indexOf("new Set(cases"));
          document.querySelector("#show-palette").click();
          const query = document.querySelector("#palette-query");
          const labels = [...body.matchAll(/"([A-Z][^"]+)"/g)].map(([, label]) => label);
          return labels.map((label) => {
            query.value = label.replace(/[^a-zA-Z0-9 ]/g, " ");
            query.dispatchEvent(new Event("input"));
            const rows = [...document.querySelectorAll("#palette-list li > span:first-child")];
            return [label, rows.some((row) => row.textContent === label)];
          });
        }"""
    )
    assert len(known) > 15
    assert [label for label, is_there in known if not is_there] == []


@pytest.mark.slow
async def test_every_key_and_button_is_in_it(page):
    await page.keyboard.press("?")
    missing = await page.evaluate(
        """async () => {
          const rows = [...document.querySelectorAll('#key-areas dd')].flatMap((d) => JSON.parse(d.dataset.labels));
          document.querySelector('#key-list').close();
          document.querySelector('#show-palette').click();
          const query = document.querySelector('#palette-query');
          const missing = [];
          for (const label of rows) {
            query.value = label.replace(/[^a-zA-Z0-9 ]/g, ' ');
            query.dispatchEvent(new Event('input'));
            const found = [...document.querySelectorAll('#palette-list li > span:first-child')];
            if (!found.some((span) => span.textContent === label)) missing.push(label);
          }
          return missing;
        }"""
    )
    # These stand for many keys, and the palette has the places that they lead to one by one.
    assert [m for m in missing if m != "Commands"] == [
        "Fill the grid with a camera (toggle, two digits for 10 to 16), 0: show the whole image"
    ]


@pytest.mark.slow
async def test_the_list_of_keys_is_searched_and_fits(page):
    await page.keyboard.press("?")
    assert 24 <= await page.locator("#key-areas dt").count() <= 30  # those that hands use
    scroller = page.locator("#key-list .scroller")
    for width, height in ((1280, 720), (1440, 900)):
        await page.set_viewport_size({"width": width, "height": height})
        box, inner = await page.locator("#key-list").bounding_box(), await scroller.bounding_box()
        assert min(box["x"], box["y"]) >= 0
        assert box["x"] + box["width"] <= width
        assert inner["y"] + inner["height"] <= box["y"] + box["height"] <= height  # the end can be scrolled to
        assert await scroller.evaluate("(element) => element.scrollWidth <= element.clientWidth")
        assert await scroller.evaluate("(element) => element.scrollHeight <= element.clientHeight")  # nothing is below
    assert "More" not in await page.locator("#key-list h3").all_inner_texts()  # every key is about something
    await page.keyboard.type("previous doubt")
    assert await page.locator("#key-list dd:visible").all_inner_texts() == [
        "Next or previous doubtful or lost frame", "Previous doubtful or lost pose by severity",
    ]  # fmt: skip
    await page.locator("#key-query").fill("interpolated between")  # the marks are listed too
    assert await page.locator("#key-list dd:visible").all_inner_texts() == ["interpolated between poses"]
    await page.keyboard.press("Escape")
    await page.get_by_role("dialog").wait_for(state="hidden")


async def test_no_two_commands_obey_the_same_key(page):
    """Each key of the table is pressed; all commands that would obey it are asked. None of them is run."""
    await page.evaluate("""() => window.addEventListener("keydown", (event) => {
        if (["Alt", "Control", "Shift"].includes(event.key)) return;
        event.preventDefault();
        event.stopImmediatePropagation();
        window.obeying = quadrille.obeying(event);
    }, { capture: true })""")
    table = await page.evaluate("quadrille.bindings.map(({ keys, label }) => [keys, label])")
    named = {"Ctrl": "Control", "Esc": "Escape", "←": "ArrowLeft", "→": "ArrowRight", "↑": "ArrowUp", "↓": "ArrowDown"}
    pressed = {}
    for shown, label in ((shown, label) for keys, label in table for shown in keys):
        first = shown.replace("1 – 9", "1")  # of a row of digits
        await page.keyboard.press("+".join(named.get(part, part) for part in first.split(" ")))
        pressed[shown, label] = await page.evaluate("window.obeying")
    assert len(pressed) > 40
    assert {key: obeying for key, obeying in pressed.items() if obeying != [key[1]]} == {}


async def test_undo_holds_in_every_part_of_the_page(page, endpoint):
    """In a field only what is being typed is undone by the field itself."""
    await page.locator("#frame").click()
    await page.keyboard.press("Control+z")
    await until(lambda: len(endpoint.heard("undo")) == 1)
    await page.keyboard.type("4")
    await page.keyboard.press("Control+z")
    await page.keyboard.press("Escape")
    await page.locator("#frame").blur()
    await page.keyboard.press("a")  # the menu of layers
    await page.locator("#layers-menu input[type=range]").first.focus()
    await page.keyboard.press("Control+Shift+z")
    await until(lambda: len(endpoint.heard("redo")) == 1)
    await (
        page.frame_locator("#scene")
        .locator("body")
        .evaluate("(body) => { const input = document.createElement('input'); body.append(input); input.focus(); }")
    )
    await page.keyboard.press("Control+z")
    await until(lambda: len(endpoint.heard("undo")) == 2)
    await page.keyboard.press("Control+k")
    assert await page.locator("#palette").is_visible()


async def test_a_key_that_does_nothing_says_why(page, endpoint):
    await page.keyboard.press("p")
    await shows(page, "document.querySelector('#advice-text').textContent === 'This session has only one person.'")
    assert not endpoint.received


@pytest.mark.slow
@pytest.mark.endpoint(n_people=2)
async def test_people_are_changed_by_key_by_name_and_by_a_click(page, endpoint):
    await page.set_viewport_size({"width": 1280, "height": 720})
    chosen = page.locator("#people input:checked")
    for key, person in (("p", 1), ("p", 0), ("Shift+P", 1), ("Shift+P", 0)):
        await page.keyboard.press(key)
        await shows(page, f"quadrille.state.state.person === {person}")
        assert await chosen.input_value() == str(person)
    await page.get_by_text("person 1", exact=True).first.click()
    await shows(page, "quadrille.state.state.person === 1")
    await page.keyboard.press("p")
    await shows(page, "quadrille.state.state.person === 0")
    await open_palette(page, "select person 1")
    await page.keyboard.press("Enter")
    await shows(page, "quadrille.state.state.person === 1")
    handles = await page.evaluate("quadrille.state.overlay.handles")
    u, v = next((h["u"], h["v"]) for h in handles if h["camera"] == 0 and h["person"] == 0 and h["point"] == "r_wrist")
    await page.mouse.click(*await to_client(page, 0, u, v))
    await shows(page, "quadrille.state.state.person === 0 && quadrille.state.state.point === 'r_wrist'")


@pytest.mark.slow
async def test_one_frame_without_a_pose_is_a_page_too(browser, endpoint, address):
    endpoint.n_frames = 1
    endpoint.state |= {
        "frame": 0, "source": None, "undo": None, "cost_px": None, "view_costs_px": [None] * 4,
    }  # fmt: skip
    page = await (await browser.new_context(viewport={"width": 1280, "height": 720})).new_page()
    errors = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    await page.goto(address)
    await shows(page, "window.quadrille?.state.shown?.frame === 0 && quadrille.state.overlay")
    assert await page.locator("#source").inner_text() == "No pose"
    for key in ("Period", "Comma", "End", "Space", "n", "k", "Control+z", "History of edits", "Escape"):
        await command(page, key)
    assert await page.locator("#frame").input_value() == "0"
    assert errors == []
    await page.context.close()


@pytest.mark.slow
async def test_a_key_is_changed_in_the_list_and_kept_in_the_file(page, endpoint, keys_file):
    keys_file.write_text("Sideways = 3\n")  # a line that the page cannot read stays
    await page.keyboard.press("?")
    await page.get_by_role("button", name="Change the key of “Track forward”").click()
    await page.keyboard.press("3")  # a key that cannot be changed
    await shows(page, "document.querySelector('#key-areas output').textContent.endsWith('keeps this key.')")
    await page.keyboard.press("Enter")
    await page.keyboard.press("g")
    await shows(page, "document.querySelector('#key-areas output')?.textContent.startsWith('Taken from “Fit to')")
    await page.keyboard.press("Escape")
    assert keys_file.read_text() == 'Sideways = 3\n"Track forward" = [\n    "G",\n]\n'
    await page.keyboard.press("g")
    await until(lambda: endpoint.heard("track"))
    assert not endpoint.heard("fit")
    for control, ending in (("#track-forward", " (G)"), ("#pin-fit", "if there are any")):  # tooltips follow
        await page.locator(control).hover(force=True)
        assert (await page.locator(control).get_attribute("title")).endswith(ending)
    await page.keyboard.press("?")
    await page.locator("#key-query").fill("inspector sizes")  # a command without a key
    await page.get_by_role("button", name="Change the key of “Inspector: sizes").click()
    await page.keyboard.press("Alt+i")
    await shows(page, "quadrille.bindings.some(({ keys }) => keys[0] === 'Alt I')")
    await page.get_by_role("button", name="Change the key of “Inspector: sizes").click()
    await page.keyboard.press("Delete")
    await shows(page, "quadrille.bindings.every(({ keys }) => keys[0] !== 'Alt I')")
    await page.locator("#reset-keys").click()
    await shows(page, "quadrille.bindings.find(({ label }) => label === 'Track forward').keys[0] === 'T'")
    assert keys_file.read_text() == "Sideways = 3\n"


async def test_a_wrong_line_of_the_file_is_named_and_the_others_count(page, keys_file):
    keys_file.write_text('"Track sideways" = ["Y"]\n"Mirror the pose left to right" = ["M"]\n')
    await page.reload()
    await shows(page, "document.querySelector('#advice-text')?.textContent.includes('Track sideways')")
    keys = await page.evaluate("quadrille.bindings.find(({ label }) => label.startsWith('Mirror')).keys")
    assert keys == ["M"]


async def test_every_key_that_a_title_names_exists(page):
    """Titles name a key in parentheses at their end; other keys of a sentence belong to the mouse or to a panel."""
    titles = await page.evaluate("[...document.querySelectorAll('[title]')].map(({ title }) => title)")
    key = re.compile(r" \(((?:(?:Ctrl|Alt|Shift)\+)*(?:[^a-z\s()]|[A-Z]\w+))\)$")
    named = [found[1] for title in titles if (found := key.search(title))]
    known = await page.evaluate("quadrille.bindings.flatMap(({ keys }) => keys.map((key) => key.replaceAll(' ', '+')))")
    assert len(named) > 20
    assert set(named) - set(known) == {"Enter", "Backspace"}  # of fields and of the floor
