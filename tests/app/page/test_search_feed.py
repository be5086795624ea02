"""What pages that watch a search at work are told of it."""

import pytest
from page_visits import visiting

from app.page import socket


@pytest.mark.parametrize("readable_s", [pytest.param(0.0, marks=pytest.mark.slow), 1e6])
async def test_figures_of_a_search_come_at_a_readable_rate_and_its_steps_at_once(placed, monkeypatch, readable_s):
    monkeypatch.setattr(socket, "_READABLE_S", readable_s)
    async with visiting(placed) as page:
        await page.send("watch", tab="search")
        await page.hear("search_runs")
        await page.send("search_speed", per_second=100)
        count = len(page.told)
        await page.send("search", action="frame", person=None)
        await page.hear("state", lambda m: m["job"]["message"], 60)
        while not any(is_over(m) for m in page.told):
            await page.hear("search_runs")
        told = page.told[count:]
        states = [m["job"] for m in told if m["type"] == "state"]
        at_work = [job for job in states if job["running"]]
        lists = [m for m in told if m["type"] == "search_runs"]
        steps = [m for m in told if m["type"] == "search_steps"]
        assert not states[-1]["running"]
        assert len(steps) > 3
        assert sum(m["count"] for m in steps) >= lists[-1]["runs"][0]["steps"] - 1
        if readable_s:
            # That it has begun, with its first steps, that they are not saved yet, and how it ended.
            assert len(at_work) in (1, 2, 3)
            assert len(lists) in (2, 3)
        else:
            assert len(at_work) > 3
            assert len(lists) > 3


def is_over(message):
    return message["type"] == "search_runs" and message["runs"] and message["runs"][0]["state"] == "over"
