"""Programs that race for the lock of a session, which each leaves behind as if it had died: one at a time holds it."""

import subprocess
import sys
import textwrap

import pytest

pytestmark = pytest.mark.slow

RACER = textwrap.dedent("""
    import os, random, sys, time
    from pathlib import Path
    from tracker.errors import SessionError
    from tracker.session.lock import LOCK_FILE, SessionLock

    folder, wanted, rng = Path(sys.argv[1]), int(sys.argv[2]), random.Random(int(sys.argv[3]))
    taken = double = 0
    while taken < wanted:
        lock = SessionLock(folder)
        try:
            lock.acquire()
        except SessionError:
            time.sleep(rng.uniform(0, 0.001))
            continue
        taken += 1
        try:
            os.close(os.open(folder / "inside", os.O_CREAT | os.O_EXCL))
            os.unlink(folder / "inside")
        except OSError:
            double += 1
        if rng.random() < 0.3:
            lock.release()
        else:  # the lock stays, with the number of a process that cannot exist
            text = (folder / LOCK_FILE).read_text().replace(f'"process": {os.getpid()},', '"process": 4194305,')
            (folder / f"{os.getpid()}").write_text(text)
            os.replace(folder / f"{os.getpid()}", folder / LOCK_FILE)
    print(double)
""")


def test_one_of_three_programs_holds_the_lock(tmp_path, cases, report):
    n = cases(30_000) // 3
    words = [sys.executable, "-c", RACER, str(tmp_path), str(n)]
    racers = [subprocess.Popen([*words, str(i)], stdout=subprocess.PIPE, text=True) for i in range(3)]
    double = sum(int(r.communicate(timeout=600)[0]) for r in racers)
    report(f"{3 * n} locks taken by three programs, {double} of them while another held it")
    assert double == 0
