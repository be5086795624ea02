"""Measure the gain of a second worker: `python tests/benchmarks/batch_workers.py --data DIR`.

Twelve copies of a recording in DIR with a first pose are tracked as a batch in turn by one worker that is held to one
core, by one worker and by two. Each line has the time by the clock, the processor time of the batch, how many cores it
used on average, and how many all other programs of the machine used meanwhile: the clock tells only where those used
few. The last lines have the time of two workers against that of one on one core and on all, and the lowest ratio that
two cores allow: half of the processor time of two workers against the time of one worker. Beside it stands what the
machine gives to two programs that share nothing: loops that do the same work, one after the other and at once. Linux
only: it reads /proc.
"""

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import NamedTuple

import quadrille
from tracker.evaluation.references import read_joints
from tracker.pipeline.given_pose import set_pose_at_joints

N_RECORDINGS = 12
LOOP = "for i in range(50_000_000): pass"
"""A program that needs one core, and no memory."""


class Round(NamedTuple):
    """A batch that was run."""

    wall_s: float
    cpu_s: float
    others: float
    """Cores that other programs used on average."""

    @property
    def cores(self) -> float:
        """Cores that the batch used on average."""
        return self.cpu_s / self.wall_s


def busy_s() -> float:
    """Processor time of all programs since the machine started, s."""
    user, nice, system, _, _, irq, softirq, *_ = map(int, Path("/proc/stat").read_text().split("\n")[0].split()[1:])
    return (user + nice + system + irq + softirq) / os.sysconf("SC_CLK_TCK")


def used_s() -> float:
    """Processor time of the children that have ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def second_core() -> float:
    """Return the time of two loops at once, as a share of their time one after the other."""
    took = []
    for n in (1, 2):
        began = time.monotonic()
        loops = [subprocess.Popen([sys.executable, "-c", LOOP]) for _ in range(n)]
        for loop in loops:
            loop.wait()
        took.append(time.monotonic() - began)
    return took[1] / (2 * took[0])


def run(source: Path, n_workers: int, cores: set[int], words: argparse.Namespace) -> Round:
    """Track twelve copies of a session by workers that may use some of the cores."""
    with tempfile.TemporaryDirectory() as name:
        lab = Path(name)
        for i in range(N_RECORDINGS):
            shutil.copytree(source, lab / f"r{i:02d}")
        (lab / "plan.toml").write_text(
            'sessions = ["r*"]\nsettings = {acquire = false, options = {whole_run = false}, '
            f'frames = "0:{words.frames}"}}'
        )
        began, busy, used = time.monotonic(), busy_s(), used_s()
        command = [sys.executable, "-m", "quadrille", "batch", str(lab / "plan.toml"), "--workers", str(n_workers)]
        subprocess.run(
            command,
            check=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            preexec_fn=lambda: os.sched_setaffinity(0, cores),
        )
        wall_s, cpu_s = time.monotonic() - began, used_s() - used
        return Round(wall_s, cpu_s, (busy_s() - busy - cpu_s) / wall_s)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder of the recordings")
    parser.add_argument("--recording", default="walk")
    parser.add_argument("--frames", type=int, default=30)
    parser.add_argument("--rounds", type=int, default=3)
    words = parser.parse_args()
    data = words.data.resolve() / words.recording
    with tempfile.TemporaryDirectory() as name:
        source = Path(name) / "session"
        session = quadrille.new_session(
            source, sorted(data.glob("*.mp4")), data / "Calib.toml", background=data / "background"
        )
        set_pose_at_joints(session, 0, 0, read_joints(data / "ground_truth.trc", session.fps), fit_sizes=False)
        cores = os.sched_getaffinity(0)
        kinds = {"1 on 1 core": (1, {min(cores)}), "1": (1, cores), "2": (2, cores)}
        rounds: dict[str, list[Round]] = {kind: [] for kind in kinds}
        machine = list[float]()
        print("    workers   by the clock, s   processor time, s   cores   cores of others")
        for _ in range(words.rounds):
            machine.append(second_core())
            for kind, (n, own) in kinds.items():
                last = run(source, n, own, words)
                rounds[kind].append(last)
                print(
                    f"{kind:>11} {last.wall_s:17.1f} {last.cpu_s:19.1f} {last.cores:7.2f} {last.others:17.2f}",
                    flush=True,
                )
    held, one, two = (median(r.wall_s for r in done) for done in rounds.values())
    print(
        f"by the clock, two workers need {two / held:.2f} of the time of one on one core, {two / one:.2f} of one on all"
    )
    least = min(r.cpu_s for r in rounds["2"]) / 2 / min(r.wall_s for r in rounds["1"])
    print(f"two cores allow {least:.2f} at best; a worker alone uses {median(r.cores for r in rounds['1']):.2f} cores")
    print(f"two loops at once need {median(machine):.2f} of their time one after the other")


if __name__ == "__main__":
    main()
