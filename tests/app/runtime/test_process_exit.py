"""How the program ends as a process, while OpenCV is at work in a thread that nobody waits for."""

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
from app import __main__ as program

def export(*_, **options):
    with tempfile.TemporaryDirectory(dir=sys.argv[-1]):
        print("at work", flush=True)
        time.sleep(60)

program._command_line = lambda words: type("App", (), {"cli": export})
sys.argv[1:1] = ["export"]
program.program()
"""


def test_termination_cleans_up_as_an_interrupt_does(tmp_path):
    with subprocess.Popen([sys.executable, "-c", EXPORTING, str(tmp_path)], stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == b"at work\n"
        assert list(tmp_path.iterdir())
        process.send_signal(signal.SIGTERM)
        assert process.wait(60) == 143
    assert not list(tmp_path.iterdir())
