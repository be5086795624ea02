"""The way of a drag through the code, from the page's message to the page's news."""

from collections import Counter

import pytest
from page_visits import visiting
from walks import traced

MAX_FILES, MAX_CROSSINGS = 40, 250
"""Of a move with the news that it makes; they may only fall."""


@pytest.fixture
def walk():
    with traced() as walk:
        yield walk


@pytest.mark.slow
async def test_a_move_passes_few_files(walk, placed):
    moves = []
    async with visiting(placed) as page:
        hold = {"person": 0, "frame": placed.state.frame, "point": "left_wrist", "camera": 0, "v": 240.0}
        await page.hear("timeline")
        await page.send("drag", phase="start", seq=100, u=320.0, **hold)
        await page.hear("overlay", lambda m: m["seq"] == 100)
        for seq in range(101, 111):
            with walk.counted() as crossings:
                await page.send("drag", phase="move", seq=seq, u=float(seq + 221), **hold)
                await page.hear("overlay", lambda m, seq=seq: m["seq"] == seq)
            moves.append(crossings)
    files, crossings = zip(*((len({*sum(m, ())}), m.total()) for m in moves), strict=True)
    assert min(files) <= MAX_FILES, sorted({*sum(min(moves, key=len), ())})
    assert min(crossings) <= MAX_CROSSINGS, min(moves, key=Counter.total).most_common(20)
    walk.assert_documented("One drag")
