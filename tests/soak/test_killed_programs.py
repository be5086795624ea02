"""The program itself, killed or ended with a full disk while a page edits: what was shown as saved is there."""

import asyncio
import json
import os
import random
import re
import resource
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import asynccontextmanager, closing, suppress

import aiohttp
import pytest
from page_driver import until
from program import ROOT, SAMPLE, Program

from tracker.session.store.annotation_store import AnnotationStore

pytestmark = pytest.mark.slow

N_FRAMES = 50
STEP_CM = 0.01
"""Each edit sets the body's x to another multiple of it, so that a stored value names its edit."""
SEED = 4


@asynccontextmanager
async def page_of(address):
    async with aiohttp.ClientSession() as client, client.ws_connect(address.replace("http", "ws") + "ws") as socket:
        yield socket


async def edit(socket, number):
    """Set the pose of the edit's frame; nobody waits for the answer."""
    await socket.send_json({"type": "seek", "frame": number % N_FRAMES})
    await socket.send_json(
        {"type": "pose", "action": "set", "person": 0, "dof": 0, "value": number * STEP_CM, "frame": number % N_FRAMES}
    )


async def watch(socket, seen):
    """Note the edits that states showed, and for each frame the last one that was shown together with `saved`."""
    with suppress(ConnectionError, RuntimeError):
        async for message in socket:
            if message.type is not aiohttp.WSMsgType.TEXT:
                continue
            state = json.loads(message.data)
            if state["type"] == "state" and state["source"] == "manual":
                number = round(state["dofs"][0] / STEP_CM)
                seen.shown.add(number)
                if state["saved"]:
                    seen.saved.add(number)
                    seen.last[state["frame"]] = max(seen.last.get(state["frame"], 0), number)


class Seen:
    """What a page has seen of its edits."""

    def __init__(self):
        self.shown, self.saved, self.last = set(), set(), {}


def stored_edits(session):
    """The number of the edit that each frame holds, read as `quadrille info` and `export` do."""
    with AnnotationStore(session / "annotations.sqlite", read_only=True) as store:
        return {
            row.frame: round(store.pose("person", row.frame).values[0] * 100 / STEP_CM)
            for row in store.frames("person")
        }


async def test_edits_shown_as_saved_survive_sigkill(tmp_path, cases, report):
    session = shutil.copytree(SAMPLE, tmp_path / "session")
    rng = random.Random(SEED)
    kills, wanted = cases(200), cases(5000)
    shown, lost, number = 0, [], 1
    for kill in range(kills):
        program, seen = Program(session), Seen()
        await program.start()
        async with page_of(program.address) as socket:
            watching = asyncio.create_task(watch(socket, seen))
            share = (wanted - shown) / (kills - kill)
            while len(seen.saved) < share:
                for _ in range(rng.randint(1, 4)):
                    await edit(socket, number)
                    number += 1
                await asyncio.sleep(rng.uniform(0, 0.04))
            await asyncio.sleep(rng.uniform(0, 0.02))
            await program.kill()
            await watching
        shown += len(seen.saved)
        stored = stored_edits(session)
        lost += [(kill, frame, n, stored.get(frame)) for frame, n in seen.last.items() if stored.get(frame, -1) < n]
    report(f"{kills} SIGKILLs, {shown} edits shown as saved, {len(lost)} lost")
    assert shown >= wanted
    assert lost == []


def command(*words, **more):
    return subprocess.run(
        [sys.executable, "-m", "quadrille", *map(str, words)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=120,
        **more,
    )


async def test_edits_on_a_full_disk_survive_the_end_of_the_program(tmp_path, cases, report, monkeypatch):
    """The limit of the size of a file stands for a full disk: the store cannot grow, a rescue file can be written."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    session = shutil.copytree(SAMPLE, tmp_path / "session")
    rng = random.Random(SEED)
    n, lost, odd = cases(20), [], []
    for case in range(n):
        program, seen = Program(session, hears_errors=True), Seen()
        await program.start()
        first = 1 + case * 100
        async with page_of(program.address) as socket:
            watching = asyncio.create_task(watch(socket, seen))
            await edit(socket, first)
            await until(lambda: first in seen.saved, 60)  # noqa: B023
            size = (session / "annotations.sqlite").stat().st_size
            resource.prlimit(program.pid, resource.RLIMIT_FSIZE, (size, size))
            last = first + rng.randint(90, 99)  # more than free pages of the file hold
            for k in range(first + 1, last + 1):
                await edit(socket, k)
            await until(lambda: last in seen.shown, 60)  # noqa: B023
            os.kill(program.pid, signal.SIGTERM)
            status = await program.ended()
            watching.cancel()
        offered = re.findall(r"kept in (\S+\.json)", program.errors)
        if status != 1 or len(offered) != 1:
            odd.append((case, status, program.errors))
            continue
        again = command("restore", session)
        if again.returncode or "rescued edits" not in again.stdout:
            odd.append((case, again.returncode, again.stdout + again.stderr))
        expected = {k % N_FRAMES: k for k in range(first, last + 1)}
        stored = stored_edits(session)
        lost += [(case, frame, k, stored.get(frame)) for frame, k in expected.items() if stored.get(frame) != k]
    report(f"{n} programs ended with a full disk, {len(odd)} without a rescue file, {len(lost)} frames lost")
    assert odd == []
    assert lost == []


WRITER = """
import sys
from dataclasses import replace
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange

store = AnnotationStore(sys.argv[1])
print("open", flush=True)
pose = store.pose("ann", 3)
for n in range(1, 100_000):
    store.commit(f"n {n}", [PoseChange("ann", f, replace(pose, values=pose.values * 0 + n)) for f in range(400)])
"""


@pytest.mark.parametrize("when", ["while it commits", "while it upgrades an older store"])
def test_a_killed_session_is_read_as_commands_read_it(tmp_path, cases, report, when):
    """A store is read after each kill without being opened for writing, and holds one edit on all frames."""
    script = (ROOT / "tests" / "tracker" / "session" / "store" / "store_version_3.sql").read_text("utf-8")
    rng, n, path, hot, odd = random.Random(SEED), cases(200), tmp_path / "annotations.sqlite", 0, []
    for case in range(n):
        if case == 0 or "upgrades" in when:
            path.unlink(missing_ok=True)
            with closing(sqlite3.connect(path)) as db:
                db.executescript(script)
                db.executemany("INSERT INTO moves (kind, edit, time) VALUES (?, 1, ?)", [("undo", "x" * 1000)] * 20_000)
                db.commit()
        writer = subprocess.Popen([sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE, cwd=ROOT)
        if "commits" in when:
            writer.stdout.readline()
            time.sleep(rng.uniform(0, 0.3))
        else:
            journal = path.with_name("annotations.sqlite-journal")
            while not journal.exists() and writer.poll() is None:
                time.sleep(0.001)
            time.sleep(rng.uniform(0, 0.2))
        writer.kill()
        writer.wait()
        hot += path.with_name("annotations.sqlite-journal").exists()
        with AnnotationStore(path, read_only=True) as store:
            poses = store.poses("ann", range(400))
            values = {pose.values[0] for pose in poses.values()}
            odd += [(case, values)] if len(values) != 1 and "commits" in when and len(poses) == 400 else []
            odd += [(case, len(poses))] if not poses else []
    report(f"{n} kills {when}, {hot} left a journal, {len(odd)} stores were not as a commit left them")
    assert odd == []
