"""Long work in one place of the page: what is done, what is left, Stop; and a search for people that fails."""

import pytest
from page_driver import shows, state_of, until

FINDING = {
    "type": "finding", "running": True, "stage": "finding first poses", "share": 0.0, "notes": [], "message": "",
    "failed": False, "tried": None, "camera": None, "frame": None, "axes": [],
}  # fmt: skip
ACQUISITION = {
    "type": "acquisition", "person": 0, "running": True, "stage": "fitting sizes", "share": 0.4, "message": "",
    "result": None,
}  # fmt: skip
REASON = "xpected silhouettes that agree, found views of which little can be explained (cam 2.left 12%)"
FAILURE = f"E{REASON}; check the background."
NOTES = ["frame 30, voxels: expected silhouettes that agree", "frame 60, voxels: expected silhouettes that agree"]


def work(page, name):
    return page.locator(f"#work-{name}")


@pytest.mark.slow
async def test_all_long_work_is_listed_in_one_place_and_can_be_stopped(page, endpoint):
    track = endpoint.state["track"] | {"running": True, "first": 12, "last": 30, "at": 15, "done": 4, "total": 18}
    ranges = {"running": True, "what": "interpolating", "done": 500, "total": 12000, "message": ""}
    endpoint.state |= {"track": track, "range": ranges, "footage": {"listed": 0.34, "error": None}}
    await endpoint.broadcast(endpoint.state | {"compiling": "contours"})
    await endpoint.broadcast(ACQUISITION)
    await shows(page, "document.querySelectorAll('#work .work').length === 5")
    await work(page, "sizes").get_by_text("Stop").wait_for()  # work that is over at once is not shown
    texts = {tuple(filter(None, text.split("\n"))) for text in await page.locator("#work .work").all_inner_texts()}
    assert texts == {
        ("Tracking", "Stop", "4 of 18"),
        ("Interpolating", "Stop", "500 of 12,000"),
        ("Compiling contours", "you can go on"),
        ("Indexing the footage", "34 %"),
        ("Acquiring sizes of person 0: fitting sizes", "Stop", "40 %"),
    }
    for name, message in {
        "track": {"type": "track", "action": "stop"},
        "range": {"type": "stop_range"},
        "sizes": {"type": "acquire", "action": "stop", "person": 0},
    }.items():
        await work(page, name).get_by_text("Stop").click()
        await until(lambda: message.items() <= endpoint.received[-1].items())  # noqa: B023
    endpoint.state |= {"track": endpoint.state["track"] | {"running": False, "first": None}}
    endpoint.state |= {"range": ranges | {"running": False}, "footage": {"listed": None, "error": None}}
    await endpoint.broadcast(endpoint.state)
    await endpoint.broadcast(ACQUISITION | {"running": False})
    await shows(page, "document.querySelectorAll('#work .work').length === 0")


@pytest.mark.slow
async def test_the_backward_pass_says_what_it_does_and_that_one_can_go_on(page, endpoint):
    track = endpoint.state["track"] | {
        "running": True,
        "first": 12,
        "last": 30,
        "at": 30,
        "stage": "back",
        "total": 490,
    }
    for done in (0, 200, 434):
        endpoint.state["track"] = track | {"done": done}
        await endpoint.broadcast(endpoint.state)
        await page.wait_for_timeout(1200)
    assert await work(page, "track").locator("b").inner_text() == "Tracking backward"
    assert await work(page, "track").locator("output").inner_text() == "you can go on, a few seconds left"
    assert await page.locator("#search-stage").inner_text() == "Tracking backward"


@pytest.mark.slow
async def test_the_time_left_is_that_of_the_work(page):
    """Shares come in steps of any size, at any moment; the time left follows and counts down between them."""
    left = await page.evaluate(
        """async () => {
          const { TimeLeft, timeText } = await import("/static/widgets/time_left.js");
          const left = new TimeLeft();
          const out = [left.at(0)];
          left.note("poses", 0, 0);
          for (const [share, time] of [[0.1, 30], [0.2, 60], [0.2, 61]]) left.note("poses", share, time);
          out.push(left.at(60), left.at(100));
          for (let step = 3; step <= 7; step++) left.note("poses", step / 10, 60 + 10 * (step - 2)); // quicker now
          out.push(left.at(110));
          left.note("sizes", 0.7, 110);
          out.push(left.at(110));
          return [out, [2, 31, 100, 7200].map(timeText)];
        }"""
    )
    assert left == [
        [None, 240, 200, pytest.approx(40, rel=0.25), None],
        ["a few seconds left", "35 s left", "2 min left", "2 h left"],
    ]


@pytest.mark.slow
async def test_people_are_searched_while_one_looks_around(page, endpoint):
    endpoint.state["people"][0]["source"] = None
    await endpoint.broadcast(endpoint.state)
    for share in (0.0, 0.1, 0.2):
        await endpoint.broadcast(FINDING | {"share": share, "tried": 12})
        await page.wait_for_timeout(1100)
    row = work(page, "find")
    assert await row.locator("b").inner_text() == "Find people: finding first poses"
    assert (await row.locator("output").inner_text()).startswith("20 %, ")
    assert (await row.locator("output").inner_text()).endswith(" left")
    await page.keyboard.press("Period")
    await until(lambda: endpoint.heard("seek") == [{"type": "seek", "frame": 13}])
    assert await row.is_visible()
    # The run that belongs to it is not listed beside it, and its Stop ends the whole.
    endpoint.state["track"] |= {"running": True, "first": 12, "last": 30, "at": 12, "done": 1, "total": 18}
    await endpoint.broadcast(endpoint.state)
    await shows(page, "document.querySelector('#work-track') && !document.querySelector('#work-find')")
    await work(page, "track").get_by_text("Stop").click()
    await until(lambda: endpoint.heard("find_people") == [{"type": "find_people", "action": "stop"}])


async def test_a_failure_is_a_sentence_with_its_silhouettes_and_a_way_on(page, endpoint):
    endpoint.state["people"][0]["source"] = None
    await endpoint.broadcast(endpoint.state)
    failure = page.locator("#find-failure")
    await endpoint.broadcast(FINDING | {"tried": 12})
    await shows(page, "quadrille.state.finding?.running")
    await endpoint.broadcast(
        FINDING | {"running": False, "failed": True, "message": FAILURE, "notes": NOTES, "tried": 12, "camera": 2}
    )
    await failure.wait_for()
    sentence = await page.locator("#failure-text").inner_text()
    assert sentence == f"People were not found: e{REASON}."
    await shows(page, "document.querySelector('#failure-silhouette').naturalWidth > 0")  # of the view that it is about
    assert endpoint.thumbnails == ["silhouette/2/12"]
    assert await page.get_by_alt_text("Silhouette in BACK on frame 12").is_visible()
    await shows(page, "'silhouette 2' in quadrille.state.shown.pictures && quadrille.state.active === 2")
    assert await page.locator("#failure-notes").is_hidden()
    await page.locator("#failure-details summary").click()
    assert await page.locator("#failure-notes li").all_inner_texts() == [FAILURE, *NOTES]
    await page.locator("#failure-place").click()
    await until(lambda: endpoint.heard("select") == [{"type": "select", "person": 0, "point": "torso"}])
    assert await failure.is_hidden()
    assert not (await state_of(page))["layers"]["shown"]["silhouette"]
    assert "Drag the square" in await page.locator(".notice.is-info").inner_text()


@pytest.mark.slow
async def test_a_failure_of_no_single_view_has_no_picture(page, endpoint):
    """Not even where its sentence happens to hold the name of a view."""
    for camera, message in ((2, FAILURE), (None, "Expected the FRONT of a head in the silhouettes, found none.")):
        endpoint.thumbnails.clear()
        await endpoint.broadcast(FINDING | {"tried": 60})
        await shows(page, "quadrille.state.finding?.running")
        await endpoint.broadcast(
            FINDING | {"running": False, "failed": True, "message": message, "tried": 60, "camera": camera}
        )
        await shows(page, "!document.querySelector('#find-failure').hidden")
        picture = page.locator("#failure-silhouette")
        if camera is not None:
            await picture.wait_for()
        else:
            assert await picture.is_hidden()
            assert endpoint.thumbnails == []


@pytest.mark.slow
async def test_a_failure_takes_nobody_away_from_another_frame(page, endpoint):
    await endpoint.broadcast(FINDING | {"tried": 60})
    await shows(page, "quadrille.state.finding?.running")
    await endpoint.broadcast(FINDING | {"running": False, "failed": True, "message": FAILURE, "tried": 60})
    await page.locator("#find-failure").wait_for()
    await page.wait_for_timeout(200)
    assert not endpoint.heard("seek")
    assert not (await state_of(page))["layers"]["shown"]["silhouette"]
    await page.locator("#failure-look").click()
    await until(lambda: endpoint.heard("seek") == [{"type": "seek", "frame": 60}])
    await shows(page, "quadrille.state.layers.shown.silhouette")
    await page.locator("#failure-close").click()
    await shows(page, "!quadrille.state.layers.shown.silhouette")
