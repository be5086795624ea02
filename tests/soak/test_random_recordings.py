"""Random recordings go from the first pose to the files of other programs, by random commands and options.

Each command does its work, or says in one sentence why not. Frames are small and few, so that many combinations are
met: two to six cameras, one to three people, every method. To repeat a case that failed:
`python tests/soak/test_random_recordings.py SEED`.
"""

import random
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tracker.session.session import load_session
from tracker.simulate.motion.scenes import SCENES, cast_of
from tracker.simulate.people.population import POPULATION
from tracker.simulate.stage.furniture import ROOMS

pytestmark = pytest.mark.slow

Words = list[object]
SIZE = (320, 240)
METHODS = ("chamfer", "chamfer", "contour", "voxel")
FORMATS = ("trc", "csv", "c3d", "bvh", "mot", "npz", "coco", "openpose", "glb", "movement", "nwb", "masks", "dataset")
QUESTIONS = (["info"], ["audit"], ["check"], ["check", "--apply"], ["next"], ["observability"], ["sync"], ["tasks"])


def random_scene(draw: random.Random, out: Path) -> Words:
    """Choose a recording."""
    scene, room = draw.choice(sorted(SCENES)), draw.choice(sorted(ROOMS))
    words: Words = ["simulate", out, "--scene", scene, "--seed", draw.randrange(1000), "--room", room]
    words += ["--size", *SIZE, "--cameras", draw.randint(2, 6), "--frames", draw.randint(2, 14)]
    if draw.random() < 0.5 and len(cast_of(scene)) == 1:
        words += ["--person", draw.choice(sorted(POPULATION))]
    if draw.random() < 0.2:
        words += ["--fisheye", "all"]
    return words


def random_run(draw: random.Random, session: Path) -> Words:
    """Choose how to track."""
    cameras = [c.camera.name for c in load_session(session).cameras]
    words: Words = ["track", session, "--method", draw.choice(METHODS)]
    if draw.random() < 0.3:
        words += ["--cameras", *draw.sample(cameras, draw.randint(1, len(cameras)))]
    for option, odds in (("--backward", 0.2), ("--no-whole-run", 0.3), ("--paper", 0.1)):
        words += [option] if draw.random() < odds else []
    if draw.random() < 0.2:
        words += ["--stride", draw.randint(2, 3)]
    return words


def story(draw: random.Random, session: Path, out: Path) -> Iterator[Words]:
    """Choose the commands of a session that exists."""
    people = [p.name for p in load_session(session).people]
    if draw.random() < 0.4:
        yield ["track", session, "--init", "auto", *(["--acquire"] if draw.random() < 0.5 else [])]
    else:
        for name in people:
            joints = session / ("truth.trc" if len(people) == 1 else f"truth_{name}.trc")
            yield ["init", session, "--joints", joints, "--person", name]
            if draw.random() < 0.5:
                yield ["acquire", session, "--person", name]
    for _ in range(draw.randint(1, 2)):
        yield random_run(draw, session)
        for question in draw.sample(QUESTIONS, 3):
            yield [question[0], session, *question[1:]]
    for name in draw.sample(FORMATS, 3):
        yield ["export", session, "--format", name, "--out", out / f"of_{name}", "--overwrite"]
    yield ["share", session, "--out", out / "share", "--overwrite"]


def done(words: Words) -> str:
    """Run a command; return what is wrong with its end, "" if nothing is."""
    line = [sys.executable, "-m", "quadrille", *map(str, words)]
    ended = subprocess.run(line, capture_output=True, text=True, timeout=1200, check=False)
    last = ended.stderr.strip().splitlines()[-1:]
    is_said = ended.returncode == 1 and bool(last) and last[0].startswith("quadrille: ")
    if "Traceback" not in ended.stderr and (ended.returncode == 0 or is_said):
        return ""
    return f"{' '.join(line[3:])}: status {ended.returncode}\n{ended.stderr[-3000:]}"


def failures(seed: int) -> Iterator[str]:
    """Play one recording; yield what went wrong."""
    draw = random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        session, out = Path(folder) / "session", Path(folder) / "out"
        out.mkdir()
        if wrong := done(random_scene(draw, session)):
            yield wrong
            return
        yield from filter(None, map(done, story(draw, session, out)))


def test_each_command_does_its_work_or_says_why_not(cases, report):
    n = cases(20)
    found = {seed: wrong for seed in range(n) if (wrong := list(failures(seed)))}
    report(f"{n} random recordings, {len(found)} with an error that is no sentence")
    assert not found, "\n".join(f"seed {seed}: {w}" for seed, wrong in found.items() for w in wrong)


if __name__ == "__main__":
    for number in sys.argv[1:]:
        print(f"seed {number}:", *failures(int(number)), flush=True)
