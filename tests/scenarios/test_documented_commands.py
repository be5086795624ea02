"""The commands of docs/commands.md run as they stand, on a recording laid out as it describes."""

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SAMPLE = ROOT / "sample_sessions" / "elbow_rotation"
CAMERAS = {"FRONT": "cam1", "RIGHT": "cam2", "BACK": "cam3"}
COMMAND = re.compile(r"^ {4}quadrille (new|track|evaluate|export)\b((?:[^\\\n]|\\\n)*)", re.MULTILINE)
FRAMES = "0:3"
"""In place of the document's longer range: the sample has 50 frames."""


@pytest.fixture
def recording(tmp_path):
    """Three cameras, their calibration, the empty scene and reference joints, named as there."""
    (tmp_path / "recording" / "background").mkdir(parents=True)
    calibration = (SAMPLE / "calibration.toml").read_text("utf-8")
    for old, new in CAMERAS.items():
        shutil.copy(SAMPLE / f"{old}.mp4", tmp_path / "recording" / f"{new}.mp4")
        shutil.copy(SAMPLE / "background" / f"{old}.png", tmp_path / "recording" / "background" / f"{new}.png")
        calibration = calibration.replace(f"[{old}]", f"[{new}]").replace(f'"{old}"', f'"{new}"')
    sections = [section for section in re.split(r"^(?=\[)", calibration, flags=re.MULTILINE) if "LEFT" not in section]
    (tmp_path / "calibration.toml").write_text("".join(sections), "utf-8")
    shutil.copy(SAMPLE / "truth.trc", tmp_path / "joints.trc")
    return tmp_path


def quadrille(folder, *words):
    program = [
        sys.executable,
        "-c",
        f"import sys; sys.path.insert(0, {str(ROOT)!r}); from app.main import main; main()",
    ]
    done = subprocess.run([*program, *words], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_commands_take_a_recording_from_videos_to_an_error(recording):
    found = [
        (command, shlex.split(rest.replace("\\\n", " ")))
        for command, rest in COMMAND.findall((ROOT / "docs" / "commands.md").read_text("utf-8"))
    ]
    written = dict(found)
    assert written.keys() == {"new", "track", "evaluate", "export"}
    quadrille(recording, "new", *written["new"])
    # In place of the hand in the page.
    quadrille(recording, "init", "my_session", "--method", "joints", "--joints", "joints.trc")
    quadrille(recording, "track", *written["track"], "--frames", FRAMES)
    shown = quadrille(recording, "evaluate", *written["evaluate"])
    assert "person: 3 frames, 0 missing, 0 lost" in shown
    exports = [w for command, w in found if command == "export" and {"motion.trc", "overlay.mp4"} & {*w}]
    assert len(exports) == 2  # others: tests/app/cli/test_export.py
    for words in exports:
        quadrille(recording, "export", *(FRAMES if re.fullmatch(r"\d+:\d+", w) else w for w in words))
    assert (recording / "motion.trc").stat().st_size > 1000
    assert (recording / "overlay.mp4").stat().st_size > 10_000
