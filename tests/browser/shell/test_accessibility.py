"""Accessibility: names, focus, reduced motion, and a page that does not jump."""

import pytest
from page_driver import command, dragging, shows, state_of, until


async def test_every_control_has_a_name_and_a_title_in_every_panel(page):
    session = await page.context.new_cdp_session(page)
    roles = {
        "button", "checkbox", "combobox", "radio", "searchbox", "slider", "spinbutton", "switch", "textbox", "tab",
        "splitter", "Iframe", "listbox", "option",
    }  # fmt: skip
    panels = ("History of edits", "Earlier sentences of the line", "Brightness and contrast of a pane", "Search panel")
    for key in ("", "a", "c", *panels, "Inspector: sizes, settings (toggle)", "Control+k", "?"):
        if key:
            await command(page, key)
        tree = (await session.send("Accessibility.getFullAXTree"))["nodes"]
        unnamed = [
            node["role"]["value"]
            for node in tree
            if not node.get("ignored")
            and node.get("role", {}).get("value") in roles
            and not node.get("name", {}).get("value", "").strip()
        ]
        assert unnamed == [], key
        untitled = await page.evaluate(
            """() => [...document.querySelectorAll('button, input, select, summary, [role=slider], [role=separator]')]
              .filter((one) => one.checkVisibility() && !one.closest('[title]') && !one.labels?.[0]?.title)
              .map((one) => one.outerHTML.slice(0, 120))"""
        )
        assert untitled == [], key
        await page.keyboard.press("Escape")


@pytest.mark.slow
async def test_all_is_reached_by_tab_and_the_focus_is_seen(page):
    await page.set_viewport_size({"width": 1280, "height": 720})
    reached, unseen = set(), []
    for _ in range(90):
        await page.keyboard.press("Tab")
        found = await page.evaluate(
            """() => {
              const one = document.activeElement;
              const mark = one.matches('.segmented input') ? one.nextElementSibling : one;
              const box = mark.getBoundingClientRect();
              const isWithin = box.width > 0 && box.right <= innerWidth + 1 && box.bottom <= innerHeight + 1
                && box.left >= -1 && box.top >= -1;
              const seen = one.matches('iframe, body') || (isWithin && getComputedStyle(mark).outlineStyle !== 'none');
              return [one.id || one.getAttribute('aria-label') || one.tagName, seen];
            }"""
        )
        reached.add(found[0])
        if not found[1]:
            unseen.append(found[0])
    assert unseen == []
    assert {"show-layers", "search-frame", "undo", "show-history", "joint-name", "play", "frame", "timeline"} <= reached


async def test_a_keyboard_alone_does_a_round_of_work(page, endpoint):
    await page.keyboard.press("Tab")
    await page.keyboard.press("Control+k")
    await page.keyboard.type("12")
    await page.keyboard.press("Escape")
    await command(page, "History of edits")
    await until(lambda: endpoint.heard("history") == [{"type": "history", "limit": 100}])
    entries = [
        {"edit": k, "label": f"drag torso, frame {k}", "author": "ada", "time": "2026-01-01T10:00:00Z", "undone": k > 2}
        for k in (3, 2, 1)
    ]
    await endpoint.broadcast({"type": "history", "entries": entries, "later": False, "earlier": False})
    await shows(page, "document.activeElement.getAttribute('aria-current') === 'step'")
    assert "frame 2" in await page.evaluate("document.activeElement.textContent")
    await page.keyboard.press("ArrowDown")
    await page.keyboard.press("Enter")
    await until(lambda: endpoint.heard("go_to") == [{"type": "go_to", "edit": 1}])
    await page.keyboard.press("Escape")
    await until(lambda: endpoint.heard("history")[-1]["limit"] == 0)
    await page.keyboard.press("Period")
    await shows(page, "quadrille.state.shown.frame === 13")


@pytest.mark.slow
async def test_the_live_region_says_what_changed(page, endpoint):
    await page.keyboard.press("Period")
    await shows(page, "document.querySelector('#announcer').textContent.startsWith('frame 13')")
    await endpoint.tell(undo="drag r_knee, frame 13")
    await shows(page, "document.querySelector('#announcer').textContent === 'drag r_knee, frame 13.'")


@pytest.mark.slow
async def test_nothing_jumps_while_work_is_under_way(page, endpoint):
    await page.set_viewport_size({"width": 1280, "height": 720})
    await shows(page, "quadrille.state.views[0].scale > 0.5")
    await page.evaluate(
        """() => {
          window.shifts = [];
          new PerformanceObserver((list) => {
            for (const entry of list.getEntries()) {
              for (const { node, previousRect: a, currentRect: b } of entry.sources) {
                if (!node) continue;
                window.shifts.push(`${node.id || node.className || node.nodeName}: ${a.x},${a.y} -> ${b.x},${b.y}`);
              }
            }
          }).observe({ type: 'layout-shift', buffered: false });
        }"""
    )
    await page.keyboard.press("f")
    await shows(page, "quadrille.state.state.job.evaluations > 1000")
    await page.keyboard.press("Escape")
    await shows(page, "!quadrille.state.state.job.running && quadrille.state.state.job.message")
    await page.keyboard.press("t")
    await shows(page, "quadrille.state.state.track.done > 12", timeout_s=20.0)
    await page.keyboard.press("Escape")
    await shows(
        page, "!quadrille.state.state.track.running && quadrille.state.overlay.frame === quadrille.state.shown.frame"
    )
    async with dragging(page, 0, "l_wrist", *[(4 * k, -3 * k) for k in range(12)]):
        pass
    await endpoint.broadcast({"type": "notice", "level": "error", "text": "the frame 9 is out of range"})
    await page.locator("#advice-text", has_text="the frame 9").wait_for()
    assert await page.evaluate("shifts") == []


@pytest.mark.slow
async def test_reduced_motion_is_respected(page):
    await page.emulate_media(reduced_motion="reduce")
    moving = await page.evaluate(
        """() => [...document.querySelectorAll('*')].filter((one) => {
          const style = getComputedStyle(one);
          const lasts = (times) => times.split(', ').some((time) => parseFloat(time) > 0);
          return (style.animationName !== 'none' && lasts(style.animationDuration)) ||
            (style.transitionProperty !== 'none' && lasts(style.transitionDuration));
        }).map((one) => one.outerHTML.slice(0, 80))"""
    )
    assert moving == []


@pytest.mark.slow
async def test_a_change_of_the_systems_scheme_recolours_the_3d_view_without_loading_it_again(page):
    frame = page.frame_locator("#scene").locator("body")
    ground = "(body) => getComputedStyle(body).backgroundColor"
    around = "getComputedStyle(document.querySelector('#scene')).backgroundColor"
    inside = "getComputedStyle(document.querySelector('#scene').contentDocument.body).backgroundColor"
    await shows(page, f"document.querySelector('#scene').contentDocument?.body && {inside} === {around}")
    dark = await frame.evaluate(ground)
    await frame.evaluate("() => (window.isLoadedOnce = true)")
    await page.emulate_media(color_scheme="light")
    await shows(page, "getComputedStyle(document.querySelector('#scene')).backgroundColor === 'rgb(201, 205, 210)'")
    assert await frame.evaluate(ground) == "rgb(201, 205, 210)" != dark
    assert await frame.evaluate("() => window.isLoadedOnce")
    assert (await state_of(page))["connected"]
