"""Two people edit one session through the program, which is killed meanwhile: nothing is lost, nothing applied twice.

Each edit sets the body's x to a multiple of a step that no other edit uses, so that a stored value names its edit.
"""

import asyncio
import json
import random
import shutil
import sqlite3
from contextlib import closing

import aiohttp
import pytest
from program import SAMPLE, Program

from tracker.session.store.annotation_store import AnnotationStore

pytestmark = pytest.mark.slow

STEP_CM = 0.01
SEED = 7
N_LISTED = 12
"""Entries of the history that a page asks for; the other person makes fewer between two messages."""
FRAMES = {"anna": range(20), "ben": range(20, 40)}
SHARED = range(40, 50)
NAMES = {"anna": "", "ben": "ben"}
"""Names by which they join: anna is the host."""


class Annotator:
    """One person: what was acknowledged, over all starts of the program."""

    def __init__(self, name, numbers):
        self.name, self._numbers = name, numbers
        self.rng = random.Random(f"{SEED} {name}")
        self.edits = {}
        """Numbers of the edits that were acknowledged, by entry of the history."""
        self.undone = {}
        """Entries that were taken back, by the entry that did it."""
        self.standing = []
        """Entries that an undo would take back, the last one first to go."""
        self.sent = set()
        """Numbers of all edits that were sent, also of those that a kill cut off."""
        self.refused = 0
        self._frame = None
        self.last = 0
        self.in_flight = None

    async def work(self, address, goal):
        """Edit and undo until so many moves are acknowledged, or the program is gone."""
        async with aiohttp.ClientSession() as client:
            url = f"{address.replace('http', 'ws')}ws?name={NAMES[self.name]}"
            async with client.ws_connect(url, max_msg_size=0) as socket:
                await socket.send_json({"type": "history", "limit": N_LISTED})
                while len(self.edits) + len(self.undone) < goal():
                    if self.rng.random() < 0.3 and self.standing:
                        await self._undo(socket)
                    else:
                        await self._edit(socket)

    async def _edit(self, socket):
        number = next(self._numbers)
        # Another frame than the last: two values of one angle in a row are one entry of the history.
        frame = self._frame = self.rng.choice([k for k in (*FRAMES[self.name], *SHARED) if k != self._frame])
        self.sent.add(number)
        self.in_flight = number
        await socket.send_json({"type": "seek", "frame": frame})
        value = number * STEP_CM
        await socket.send_json({"type": "pose", "action": "set", "person": 0, "dof": 0, "value": value, "frame": frame})
        entry = await self._acknowledged(socket, lambda label: not label.startswith(("undo:", "redo:")))
        assert entry is not None, "an edit of a free frame is not refused"
        self.edits[entry] = number
        self.standing.append(entry)
        self.in_flight = None

    async def _undo(self, socket):
        self.in_flight = "undo"
        await socket.send_json({"type": "undo"})
        entry = await self._acknowledged(socket, lambda label: label.startswith("undo:"))
        self.in_flight = None
        if entry is None:  # the other one has changed the pose since
            self.refused += 1
            await self._edit(socket)
            return
        self.undone[entry] = self.standing.pop()

    async def _acknowledged(self, socket, fits):
        """Entry of the history that one's last message made; None where it was refused."""
        while True:
            message = await asyncio.wait_for(socket.receive(), 60)
            if message.type is aiohttp.WSMsgType.BINARY:
                continue
            if message.type is not aiohttp.WSMsgType.TEXT:
                raise ConnectionError("the program is gone")
            told = json.loads(message.data)
            if told["type"] == "notice" and "changed it since" in told["text"]:
                return None
            assert told["type"] != "notice", told
            if told["type"] == "history":
                own = [e for e in told["entries"] if e["author"] == self.name and e["edit"] > self.last]
                if own and fits(own[0]["label"]):
                    self.last = own[0]["edit"]
                    return self.last

    def reconcile(self, log):
        """Learn from the store whether the message that a kill cut off was carried out."""
        missed = [e for e, edit in sorted(log.items()) if edit.author == self.name and e > self.last]
        assert len(missed) <= (self.in_flight is not None), "at most one message was under way"
        for entry in missed:
            self.last = entry
            if log[entry].takes is None:
                self.edits[entry] = log[entry].number
                self.standing.append(entry)
            else:
                self.undone[entry] = self.standing.pop()
        self.in_flight = None


class Logged:
    """An entry of the history as it is stored."""

    def __init__(self, author, number, frame, takes, previous):
        self.author, self.number, self.frame, self.takes, self.previous = author, number, frame, takes, previous


def read_log(session):
    """The entries of the history, read beside the program's own code."""
    with closing(sqlite3.connect(session / "annotations.sqlite")) as db:
        row = db.execute("SELECT value FROM settings WHERE key = 'taken_back'").fetchone()
        taken = {int(k): v for k, v in json.loads(row[0]).items()} if row else {}
        log = {}
        sql = "SELECT e.id, e.author, c.numbers, c.frame, c.previous FROM edits e JOIN pose_changes c ON c.edit = e.id"
        for edit, author, numbers, frame, previous in db.execute(sql).fetchall():
            assert edit not in log, "each entry changes one pose once"
            number = None if numbers is None else round(memoryview(numbers).cast("d")[0] * 100 / STEP_CM)
            log[edit] = Logged(author, number, frame, taken.get(edit), previous)
    return log


def expected(log):
    """The number of each frame after all entries in their order."""
    now, before = {}, {}
    for entry, edit in sorted(log.items()):
        before[entry] = now.get(edit.frame)
        now[edit.frame] = before[edit.takes] if edit.takes is not None else edit.number
    return {frame: number for frame, number in now.items() if number is not None}


async def test_two_annotators_and_a_program_that_is_killed(tmp_path, cases, report):
    session = shutil.copytree(SAMPLE, tmp_path / "session")
    numbers = iter(range(1, 10**6))
    anna, ben = (Annotator(name, numbers) for name in FRAMES)
    kills, wanted, rng = cases(50), cases(2000), random.Random(SEED)
    port = 0
    for kill in range(kills + 1):
        program = Program(session, "--annotator", "anna")
        await program.start(port)
        goal = wanted * (kill + 1) / (2 * (kills + 1))
        both = [asyncio.ensure_future(one.work(program.address, lambda goal=goal: goal)) for one in (anna, ben)]
        await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)  # the other one is at work when it is killed
        if kill == kills:
            await asyncio.wait(both)
        else:
            await asyncio.sleep(rng.uniform(0, 0.05))
        await program.kill()
        for end in await asyncio.gather(*both, return_exceptions=True):
            assert end is None or isinstance(end, ConnectionError | aiohttp.ClientError), end
        log = read_log(session)
        for one in (anna, ben):
            one.reconcile(log)
    with AnnotationStore(session / "annotations.sqlite", read_only=True) as store:  # its checksums hold
        stored = {
            f.frame: round(store.pose("person", f.frame).values[0] * 100 / STEP_CM) for f in store.frames("person")
        }
    made = [edit.number for edit in log.values() if edit.takes is None]
    n_edits, n_undone = (sum(len(each) for each in of) for of in ((anna.edits, ben.edits), (anna.undone, ben.undone)))
    refused = anna.refused + ben.refused
    report(
        f"{kills} kills, {n_edits} edits, {n_undone} undos of one's own, {refused} refused because the other one had "
        f"changed the pose since; {len(made) - len(set(made))} applied twice"
    )
    assert n_edits + n_undone >= wanted
    assert len(made) == len(set(made)), "nothing is applied twice"
    for one in (anna, ben):
        own = {e: edit for e, edit in log.items() if edit.author == one.name}
        assert {e: edit.number for e, edit in own.items() if edit.takes is None} == one.edits, "nothing is lost"
        assert {e: edit.takes for e, edit in own.items() if edit.takes is not None} == one.undone
        assert all(log[taken].author == one.name for taken in one.undone.values()), "each undo takes back one's own"
    assert stored == expected(log)
