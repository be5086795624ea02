import io
import json
import sys
import time
from concurrent.futures import ThreadPoolExecutor, wait

import numpy as np
import pytest
from command_line import SAMPLE
from rich.console import Console

from app.bench import acquisition_rows, calibration_rows, contour_rows, diagnosis_rows, report, voxel_rows
from app.bench import rows as bench_rows
from app.bench.opencv_oracle import PaintedCost
from app.bench.rows import Row, Yardstick
from app.bench.sample_frames import read_crowd, read_frame
from app.main import main
from tracker.errors import TrackerError
from tracker.session.assemble import DEFAULT_MODEL


@pytest.fixture(scope="module")
def frame():
    return read_frame(SAMPLE)


def row(name, time_us, must=None):
    return Row(name, f"what {name} is", time_us, 2 * time_us, 1000.0, must)


def test_the_painted_cost_is_honest(frame):
    """Written with other means, it says the same of poses, good and bad: to 0.3 px, and in the same order."""
    cost = frame.cost()
    painted = PaintedCost(frame.views, frame.model, cost.edge_points_px)
    poses = frame.candidates(25)
    fast, slow = cost.of_person(0, poses, [frame.values])[0], np.array([painted(p) for p in poses])
    assert np.ptp(fast) > 2
    assert np.abs(fast - slow).mean() < 0.3
    assert np.corrcoef(fast, slow)[0, 1] > 0.99
    assert np.argmin(fast) == np.argmin(slow)


def test_work_and_yardstick_are_timed_in_turns():
    order = []

    class Logged(Yardstick):
        def __call__(self):
            order.append("yardstick")
            super().__call__()

    timed = Logged().beside(lambda: order.append("work"), 3, times=2)
    assert order == ["work", "yardstick"] * 4  # a first run for nothing
    assert 0 < timed.work_us < timed.yardstick_us


def test_differences_are_taken_in_turns(monkeypatch):
    """A machine that becomes slower from run to run adds as much to both, and the first run is for nothing."""
    took_s = {"long": iter((9.0, 3.0, 4.0, 5.0)), "short": iter((1.0, 1.0, 2.0, 3.0))}
    monkeypatch.setattr(bench_rows, "spent_s", lambda work: (work() or 0.0) * np.array([1.0, 2.0]))
    timed = Yardstick().beside_difference(lambda: next(took_s["long"]), lambda: next(took_s["short"]), 3)
    assert (timed.work_us, timed.clock_us) == (2e6, 4e6)


def test_times_do_not_grow_with_what_other_programs_do():
    for timed in (
        Yardstick().beside_difference(lambda: time.sleep(0.02), lambda: None, 3),
        Yardstick().beside(lambda: time.sleep(0.02), 3),
    ):
        assert abs(timed.work_us) < 5_000 < 15_000 < timed.clock_us
        assert timed.yardstick_us > 0


def test_the_processor_time_is_that_of_all_threads():
    """Two yardsticks on two threads take the time of two, whatever the clock says."""
    yardstick, pool = Yardstick(), ThreadPoolExecutor(2)

    def twice():
        wait([pool.submit(lambda: [yardstick() for _ in range(5)]) for _ in range(2)])

    timed = yardstick.beside(twice, 5)
    assert 7 < timed.work_us / timed.yardstick_us < 14


@pytest.mark.slow
def test_every_kind_of_row_can_be_measured(frame, monkeypatch):
    """Not how fast, only that they run and tell what they should."""

    def beside(self, work, runs, times=1):
        done = work()
        return bench_rows.Timed(2.0 * (done if isinstance(done, int) else 1), 1.0, 1.0)

    def beside_difference(self, long, short, runs):
        return bench_rows.Timed(2.0 * (long() - short()), 1.0, 1.0)

    monkeypatch.setattr(Yardstick, "beside", beside)
    monkeypatch.setattr(Yardstick, "beside_difference", beside_difference)
    monkeypatch.setattr(bench_rows, "_PIPELINE_FRAMES", range(5, 8))
    monkeypatch.setattr(diagnosis_rows, "_N_FRAMES", 3)
    cones = frame.with_model("gavrila22_cones")
    rows = [
        *bench_rows.candidates(frame, cones, Yardstick()),
        *bench_rows.searches(frame, cones, Yardstick()),
        *bench_rows.iterations(cones, cones, Yardstick()),
        contour_rows.iteration(cones, Yardstick()),
        *contour_rows.solves(cones, Yardstick()),
        voxel_rows.voxel_frame(frame, Yardstick()),
        *bench_rows.evolution(cones, Yardstick()),
        *acquisition_rows.acquisitions(frame, Yardstick()),
        *calibration_rows.adjustment(Yardstick()),
        *diagnosis_rows.diagnoses(frame.with_model(DEFAULT_MODEL), Yardstick()),
        *bench_rows.crowds(read_crowd(SAMPLE.with_name("tango"), 25), Yardstick()),
    ]
    names = [r.name for r in rows]
    assert (
        len(set(names)) == len(names) == report.N_ROWS - 7
    )  # all but the pipelines, the whole run and the first start
    assert {r.ratio for r in rows} == {2.0}
    notes = {r.name: r.note for r in rows}
    assert (notes["diagnosis"], notes["diagnosis_turned"]) == ("names no camera", "names FRONT")
    assert all(r.must is not None and r.aim < r.must for r in rows if r.aim is not None)


def test_a_ratio_beyond_the_tolerance_is_slower(tmp_path):
    kept = tmp_path / "kept.json"
    report.save_baseline([row("a", 100), row("b", 100), row("c", 100)], kept, 0.3)
    found = report.report(
        [row("a", 125, must=0.11), row("b", 135, must=0.2), row("d", 9999)], report.read_baseline(kept)
    )
    assert found["slower"] == ["b"]
    assert [r["holds"] for r in found["rows"]] == [False, True, None]
    first = found["rows"][0]
    assert (first["processor_us"], first["clock_us"], first["busy_cores"]) == (125, 250, 0.5)
    assert found["cores"] >= 1
    assert len(found["load"]) == 3
    assert [r["baseline"] for r in found["rows"]] == [0.1, 0.1, None]  # what is new is compared with nothing
    assert found["tolerance"] == 0.3
    assert {"python", "numpy", "numba", "opencv-python-headless"} <= found["versions"].keys()
    json.dumps(found)


@pytest.mark.parametrize(("width", "n_columns"), [(1000, 8), (95, 4)])
def test_a_table_breaks_no_word_and_shows_the_verdict(width, n_columns):
    work = "a search of the trunk in six views of a child"
    found = report.report([row(work, 125, must=0.11)], {"tolerance": 0.3, "ratios": {}})
    console = Console(width=width, file=io.StringIO())
    report.show(found, console)
    head, line, *_ = console.file.getvalue().splitlines()
    assert len(head.split()) == n_columns
    assert (work in line, line.rstrip().endswith("fails")) == (True, True)


def test_the_baseline_knows_every_row():
    kept = report.read_baseline()
    assert len(kept["ratios"]) == report.N_ROWS
    assert 0 < kept["tolerance"] < 1


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "not valid JSON"),
        ("[" * 100_000, "not valid JSON"),
        ("[]", "a group of keys"),
        ('{"tolerance": 0.3}', "the key 'ratios'"),
        ('{"tolerance": 1e300, "ratios": {}}', "as 'tolerance', found 1e"),
        ('{"tolerance": 0.3, "ratios": {"a": "fast"}}', "as 'ratios'"),
    ],
    ids=lambda text: text[:20],
)
def test_a_malformed_baseline(tmp_path, text, expected):
    path = tmp_path / "kept.json"
    path.write_text(text)
    with pytest.raises(TrackerError, match=rf"baseline .*kept\.json.*{expected}"):
        report.read_baseline(path)


def test_the_command_says_by_its_status_what_became_slower(tmp_path, monkeypatch, capsys):
    kept = tmp_path / "kept.json"
    for time_us, status in ((100, None), (135, None), (145, 1)):
        monkeypatch.setattr(report, "measure", lambda t=time_us: iter([row("a", t, must=0.2)]))
        words = ["--baseline", str(kept)] if kept.exists() else ["--save", str(kept)]
        monkeypatch.setattr(sys, "argv", ["quadrille", "bench", "--json", *words])
        if status is None:
            main()
        else:
            with pytest.raises(SystemExit, match=str(status)):
                main()
        told = json.loads(capsys.readouterr().out)
        assert told["slower"] == (["a"] if status else [])
        assert told["rows"][0]["processor_us"] == time_us
