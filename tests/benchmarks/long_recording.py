"""Track a recording of 20,000 frames in stretches: `python tests/benchmarks/long_recording.py --data DIR`.

The footage is that of a recording in DIR, played forth and back (`looped_footage.py`). A batch of this one recording is
tracked by local workers. The table has, for each stretch, the most memory that its worker had, and its processor time.
Then follow the seams, the error against the true joints on all frames, at seams and near them, the size of the store,
and the most memory of the programs that read it. Linux only: it reads /proc.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from looped_footage import forth_and_back, write_all

import quadrille
from tracker.batch.claims import read_holder
from tracker.batch.manifest import Manifest
from tracker.formats.trc import read_trc, write_trc

PROGRAM = [sys.executable, "-m", "quadrille"]
LOOK_S = 0.5
NEAR = 15
"""Frames beside a seam that count as near it."""


def memory_mb(pid: int) -> float:
    """Memory that a process has now, MB; 0 if it has ended."""
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
    except (OSError, IndexError):
        return 0.0


def watch(claims: Path, running: subprocess.Popen[bytes]) -> dict[str, tuple[float, float]]:
    """Return the memory of the worker of each task when that began, and the most that it had, MB."""
    found: dict[str, tuple[float, float]] = {}
    while running.poll() is None:
        for path in claims.glob("[0-9]*"):
            if (holder := read_holder(path)) is not None:
                now = memory_mb(holder.process)
                first, most = found.get(path.name, (now, 0.0))
                found[path.name] = (first, max(now, most))
        time.sleep(LOOK_S)
    return found


def peak_mb(words: list[str]) -> float:
    """Run a command; return the most memory that it had, MB."""
    most = 0.0
    with tempfile.TemporaryFile() as out:
        child = subprocess.Popen(words, stdout=out, stderr=subprocess.STDOUT)
        while child.poll() is None:
            most = max(most, memory_mb(child.pid))
            time.sleep(0.05)
        if child.returncode:
            out.seek(0)
            print(out.read().decode()[-2000:])
    return most


def opened_mb(session: Path) -> float:
    """Memory of the program that has a session open, when its page could be loaded, MB."""
    from urllib.request import urlopen

    words = [*PROGRAM, "open", str(session), "--no-browser", "--no-token", "--port", "18765"]
    program = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        until = time.monotonic() + 60
        while time.monotonic() < until and program.poll() is None:
            time.sleep(1)
            try:
                with urlopen("http://127.0.0.1:18765/", timeout=20) as page:
                    if page.status == 200 and len(page.read()) > 1000:
                        time.sleep(5)
                        break
            except OSError:
                continue
        return memory_mb(program.pid)
    finally:
        program.terminate()
        program.wait()


def long_reference(source: Path, path: Path, n: int, fps: float) -> None:
    """Write the true joints of looped footage."""
    table = read_trc(source)
    rows = list(forth_and_back(len(table.points), n))
    write_trc(path, table.names, table.points[rows], fps)


def report(manifest: Manifest, memory: dict[str, tuple[float, float]]) -> None:
    """Print the table of stretches, and the seams."""
    (task,) = manifest.tasks
    parts = [t for t in manifest.with_stretches(task).stretches() if manifest.result(t) is not None]
    print("frames            processor time, s   memory at the beginning and at most, MB")
    for part in parts:
        assert part.stretch is not None
        first, most = memory.get(part.key, (float("nan"), float("nan")))
        result = manifest.result(part)
        assert result is not None
        print(f"{part.stretch.first:6}:{part.stretch.last + 1:<6} {result.cpu_seconds:12.0f} {first:18.0f} {most:6.0f}")
    most = np.array([memory[p.key][1] for p in parts if p.key in memory])
    if len(most) > 2:
        slope = np.polyfit(np.arange(len(most)), most, 1)[0]
        print(f"most memory: mean {most.mean():.0f} MB, least {most.min():.0f}, most {most.max():.0f}; ", end="")
        print(f"growth from each stretch to the next one {slope:+.1f} MB")
    result = manifest.result(task)
    if result is not None:
        apart = sorted(s.apart_mm for s in result.seams)
        print(
            f"the recording: {result.state} {result.error}, {result.cpu_seconds:.0f} s of processors, {result.statuses}"
        )
        print(f"seams, mm: {apart}; over the tolerance: {sum(s.is_over for s in result.seams)}")


def errors(session: Path, truth: Path, seams: list[int]) -> dict[str, Any]:
    """Return the mean error of the limb joints, mm: of all frames, at seams, near them; and the step across seams."""
    known = quadrille.evaluate(session, truth)
    by_frame = {f.frame: f.mean_mm for f in known.per_frame}
    near = {k for s in seams for k in range(s - NEAR, s + NEAR)}
    poses = quadrille.read_poses(session)
    steps = 1000 * np.linalg.norm(np.diff(poses.joints, axis=0), axis=2).max(axis=1)
    at = [int(np.flatnonzero(poses.frames == s)[0]) - 1 for s in seams]
    return {
        "all": float(np.mean([*by_frame.values()])),
        "at seams": float(np.mean([by_frame[s] for s in seams])) if seams else None,
        "near seams": float(np.mean([v for k, v in by_frame.items() if k in near])) if seams else None,
        "largest step of a joint from frame to frame: median, 99 %": np.percentile(steps, [50, 99]).round(1).tolist(),
        "largest step across a seam": [round(float(steps[i]), 1) for i in at],
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder of the recordings")
    parser.add_argument("--recording", default="walk")
    parser.add_argument("--frames", type=int, default=20000)
    parser.add_argument("--stretch", type=int, default=1000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--options", default="{whole_run = false}", help="of the tracker, as the plan has them")
    parser.add_argument("--folder", type=Path, help="to keep footage, session and batch in, and to take them up again")
    words = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder, source = words.folder or Path(name), words.data / words.recording
        files = write_all(sorted(source.glob("*.mp4")), folder / "footage", words.frames)
        session = folder / "session"
        if not session.exists():
            quadrille.new_session(session, files, source / "Calib.toml", background=source / "background")
        plan = folder / "plan.toml"
        plan.write_text(
            f'sessions = ["session"]\nsettings = {{frames = "0:{words.frames}", stretch = {words.stretch}, '
            f"options = {words.options}}}\n"
        )
        batch = folder / "plan_batch"
        running = subprocess.Popen([*PROGRAM, "batch", str(plan), "--workers", str(words.workers)])
        try:
            memory = watch(batch / "claims", running)
        except KeyboardInterrupt:
            running.wait()
            raise
        kept = folder / "memory.json"
        if kept.exists():
            memory = {**json.loads(kept.read_text()), **memory}
        kept.write_text(json.dumps(memory))
        manifest = Manifest.load(batch)
        report(manifest, memory)
        result = manifest.result(manifest.tasks[0])
        if result is None or result.state != "done":
            return
        store = (session / "annotations.sqlite").stat().st_size
        print(f"store: {store / 1e6:.0f} MB, {store / words.frames:.0f} bytes a frame")
        truth = folder / "truth.trc"
        fps = quadrille.open_session(session).fps
        long_reference(source / "ground_truth.trc", truth, words.frames, fps)
        for title, value in errors(session, truth, [s.frame for s in result.seams]).items():
            print(f"{title}: {value}")
        for command in (
            ["info", str(session)],
            ["evaluate", str(session), "--reference", str(truth)],
            ["export", str(session), "--out", str(folder / "out.csv"), "--overwrite"],
            ["batch", str(plan), "--table"],
        ):
            print(f"quadrille {command[0]}: {peak_mb([*PROGRAM, *command]):.0f} MB at most")
        print(f"quadrille open: {opened_mb(session):.0f} MB")


if __name__ == "__main__":
    main()
