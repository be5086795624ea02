"""Random seeks while a video is truncated, emptied, overwritten, removed and replaced."""

import asyncio
import os
import shutil

import aiohttp
import numpy as np
import pytest
from command_line import SAMPLE
from page_visits import joined
from program import Program

pytestmark = pytest.mark.slow

_LAST = 49
_WAYS = ("truncate", "empty", "overwrite", "remove", "replace_by_part", "replace_by_other", "touch")


def damage(path, other, way, rng):
    """Change a file as a way says."""
    whole = path.read_bytes()
    at = int(rng.integers(0, len(whole)))
    match way:
        case "truncate" | "empty":
            os.truncate(path, at if way == "truncate" else 0)
        case "overwrite":
            with path.open("r+b") as file:
                file.seek(at)
                file.write(rng.bytes(5000))
        case "remove":
            path.unlink()
        case "replace_by_part" | "replace_by_other":
            part = path.with_name("unfinished")
            part.write_bytes(whole[:at] if way == "replace_by_part" else other)
            part.replace(path)
        case "touch":
            path.touch()


async def test_seeks_in_footage_that_changes_lose_no_socket(tmp_path, cases, report, capfd):
    session = shutil.copytree(SAMPLE, tmp_path / "session")
    videos = sorted(session.glob("*.mp4"))
    kept = {video: video.read_bytes() for video in videos}
    other = videos[1].read_bytes() + b"\0"
    rng, n = np.random.default_rng(21), cases(100)
    lost, notices, ended = [], 0, None
    program = Program(session)
    await program.start()
    try:
        case = 0
        while case < n and ended is None:
            for video, data in kept.items():
                video.write_bytes(data)
            try:
                async with joined(program.address) as page:
                    while case < n:
                        video, way = videos[rng.integers(0, len(videos))], _WAYS[case % len(_WAYS)]
                        frame = int(rng.integers(0, _LAST))
                        case += 1
                        await page.send("seek", frame=frame)
                        if rng.integers(0, 2):
                            await asyncio.sleep(float(rng.random() * 0.05))
                        damage(video, other, way, rng)
                        for _ in range(3):
                            frame = int(rng.integers(0, _LAST))
                            await page.send("seek", frame=frame)
                            await asyncio.sleep(float(rng.random() * 0.1))
                        await page.hear("image", lambda m, k=frame: m["frame"] == k, timeout_s=60)
                        video.write_bytes(kept[video])
                        notices += sum(m["type"] == "notice" for m in page.told)
                        page.told.clear()
            except (AssertionError, aiohttp.ClientError, ConnectionError, TimeoutError) as error:
                lost.append((case, repr(error)[:300]))
                await asyncio.sleep(1.0)
                ended = program.status
        if ended is None:
            async with joined(program.address) as page:  # all cameras are shown again
                await page.hear("advice", lambda m: all(a["situation"] != "damaged" for a in m["said"]), timeout_s=60)
    finally:
        await program.kill()
    report(
        f"{case} changes of videos among {4 * case} seeks: {'1 crash' if ended else '0 crashes'}, {len(lost)} sockets "
        f"lost, {notices} notices"
    )
    errors = capfd.readouterr().err
    assert (ended, lost) == (None, []), errors[-6000:]
    assert "Traceback" not in errors, errors[-4000:]
