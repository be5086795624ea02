"""How the program ends as a process, while OpenCV is at work in a thread that nobody waits for."""

import os
import signal
import subprocess
import sys

import pytest

AT_WORK = """
import atexit, sys, threading
import cv2, numpy as np
from app.runtime import process_exit

def blur():
    image = np.zeros((400, 400), np.uint8)
    while True:
        cv2.GaussianBlur(image, (9, 9), 2.0)
        started.set()

started = threading.Event()

def main():
    atexit.register(print, "closed")
    for _ in range(4):
        threading.Thread(target=blur, daemon=True).start()
    started.wait(60)
    {ends}

{run}
"""


def ended(ends, run="process_exit.run(main)"):
    program = AT_WORK.replace("{ends}", ends).replace("{run}", run)
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ends", "status"), [("pass", 0), ("sys.exit(1)", 1), ("sys.exit(130)", 130), ("sys.exit()", 0), ("1 / 0", 1)]
)
def test_it_ends_with_its_status(ends, status):
    done = ended(ends)
    assert done.returncode == status
    assert done.stdout == "closed\n"
    assert ("ZeroDivisionError" in done.stderr) == (ends == "1 / 0")
    assert "terminate" not in done.stderr


EXPORTING = """
import sys, tempfile, time
from app import main as program

def export(*_, **options):
    with tempfile.TemporaryDirectory(dir=sys.argv[-1]):
        print("at work", flush=True)
        time.sleep(60)

program._command_line = lambda words: type("App", (), {"cli": export})
sys.argv[1:1] = ["export"]
program.program()
"""


def heed_hangups():
    """Undo what nohup hands down, if the tests run under it."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def take_terminal(terminal):
    heed_hangups()
    os.login_tty(terminal)


@pytest.mark.slow
@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_termination_cleans_up_as_an_interrupt_does(tmp_path, number, status):
    words = [sys.executable, "-c", EXPORTING, str(tmp_path)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, preexec_fn=heed_hangups) as process:
        assert process.stdout.readline() == b"at work\n"
        assert list(tmp_path.iterdir())
        process.send_signal(number)
        assert process.wait(60) == status
    assert not list(tmp_path.iterdir())


OF_A_TERMINAL = """
import os, sys, time
from app.runtime import process_exit

def main():
    try:
        print("at work", flush=True)
        time.sleep(60)
    except process_exit.TerminationError as error:
        sys.exit(error.status)
    finally:
        print("saving " * 1000, flush=True)  # on a terminal that has gone
        open(sys.argv[1], "w").close()

process_exit.run(main)
"""


def test_the_end_of_the_terminal_does_not_keep_work_from_being_saved(tmp_path):
    ours, theirs = os.openpty()
    process = subprocess.Popen(
        [sys.executable, "-c", OF_A_TERMINAL, str(tmp_path / "saved")],
        stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True, preexec_fn=lambda: take_terminal(theirs),
    )  # fmt: skip
    os.close(theirs)
    assert b"at work" in os.read(ours, 100)
    os.close(ours)  # which sends SIGHUP
    assert process.wait(60) == 129
    assert (tmp_path / "saved").exists()


def test_a_program_of_nohup_goes_on_without_a_terminal():
    program = "import signal; from app.runtime import process_exit; process_exit.run(lambda: signal.raise_signal(1))"
    assert subprocess.run(["nohup", sys.executable, "-c", program], capture_output=True, timeout=60).returncode == 0
