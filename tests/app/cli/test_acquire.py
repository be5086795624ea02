"""`quadrille acquire`: its JSON, a body that goes to the next session, and a fit that is stopped."""

import hashlib
import json
import signal

import numpy as np
import pytest
from command_line import SAMPLE, assert_refused, output_of, stored

from tracker.estimation.acquisition import size_fit
from tracker.estimation.acquisition.shape_search import ChamferSearchSettings
from tracker.estimation.acquisition.two_views import TwoViewSettings
from tracker.formats.model_toml import format_model, load_model
from tracker.session.session import load_session

KEYS = {
    "person", "frames", "views", "cost_before_px", "cost_after_px", "height_m", "sizes", "model", "evaluations",
    "voxels", "segments", "swings_deg", "notes",
}  # fmt: skip
"""Those that docs/log/acquisition.md lists."""


@pytest.fixture
def quick(monkeypatch):
    """A fit of one step in each round."""
    solve = size_fit.solve_bundle
    monkeypatch.setattr(
        size_fit, "solve_bundle", lambda bundle, state, _, report: solve(bundle, state, 1, report=report)
    )


def files_of(session):
    """Hash of each file of a session."""
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in session.rglob("*") if p.is_file()}


def new_session(run, path, *more):
    return run(
        "new", path, "--calibration", SAMPLE / "calibration.toml", "--videos", *sorted(SAMPLE.glob("*.mp4")),
        "--background", SAMPLE / "background", *more,
    )  # fmt: skip


@pytest.mark.slow
def test_an_acquired_body_goes_to_the_next_session(run, placed, quick, tmp_path):
    body = tmp_path / "ann.toml"
    words = ("acquire", placed, "--frames", "20:23", "--n-frames", "2", "--out", body, "--json")
    status, out, err = run(*words)
    report = json.loads(out)
    assert (status, err) == (0, "")
    assert report.keys() == KEYS
    assert report["sizes"][0].keys() == {"name", "before_m", "after_m", "sigma_m"}
    assert report["segments"][0].keys() == {"name", "length_m", "sigma_m"}
    assert report["swings_deg"].keys() == {"shoulder", "elbow", "hip", "knee"}
    assert report["notes"] == []  # the joints of frame 20 are known
    assert (report["person"], len(report["frames"]), report["views"]) == (
        "person",
        2,
        ["FRONT", "RIGHT", "BACK", "LEFT"],
    )
    acquired = load_session(placed).people[0].model
    assert body.read_text() == report["model"] == format_model(acquired)
    assert report["height_m"] == acquired.height_m
    for name, more in (("s2", ("--people", "ann", "--model", f"ann={body}")), ("s3", ("--person-model", body))):
        second = tmp_path / name
        assert new_session(run, second, *more)[0] == 0
        (person,) = load_session(second).people
        assert format_model(person.model) == report["model"]
    assert run("init", second, "--joints", SAMPLE / "truth.trc", "--frame", "20")[0] == 0
    status, out, _ = run("track", second, "--frames", "20:22", "--json")
    assert (status, json.loads(out)["frames"]) == (0, 2)
    assert all(np.isfinite(p.cost_px) for k, p in stored(second).items() if k == 21)
    assert json.loads(run("info", second, "--json")[1])["people"][0]["height_m"] == pytest.approx(acquired.height_m)


def test_a_fit_that_is_stopped_leaves_the_session_as_it_was(run, placed, monkeypatch, tmp_path):
    before, steps, linearize = files_of(placed), [], size_fit.ContourBundle.linearize

    def stopped(problem, state, *below):
        steps.append(linearize(problem, state))
        if len(steps) == 2:
            signal.raise_signal(signal.SIGINT)  # as Ctrl+C does
        return steps[-1]

    monkeypatch.setattr(size_fit.ContourBundle, "linearize", stopped)
    words = ("acquire", placed, "--frames", "20:23", "--n-frames", "2", "--out", tmp_path / "b.toml", "--json")
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it
    try:
        status, out, _ = run(*words)
    finally:
        signal.signal(signal.SIGINT, handler)
    assert (status, out, len(steps)) == (130, "", 2)
    assert files_of(placed) == before
    assert not (tmp_path / "b.toml").exists()
    assert not (placed / "lock.json").exists()


@pytest.mark.slow
def test_the_paper_s_way_names_its_views(run, placed, monkeypatch):
    quick = TwoViewSettings(search=ChamferSearchSettings(levels=1, passes=1))
    monkeypatch.setattr("tracker.estimation.acquisition.two_views.TwoViewSettings", lambda views, n, coupled: quick)
    words = ("acquire", placed, "--paper", "--frames", "20:21", "--dry-run")
    status, out, _ = run(*words, "--json")
    found = json.loads(out)
    assert (status, found.keys()) == (0, KEYS)
    assert (found["frames"], len(found["views"])) == ([20], 2)
    assert {s["sigma_m"] for s in found["sizes"]} == {None}
    assert format_model(load_session(placed).people[0].model) != found["model"]
    out = output_of(run(*words))
    assert f"from frame 20, front view {found['views'][0]}, side view {found['views'][1]}" in out


@pytest.mark.slow
def test_voxels_before_the_contours(run, placed, quick):
    words = ("acquire", placed, "--method", "voxels", "--frames", "20:23", "--n-frames", "2")
    status, out, err = run(*words, "--json", "--dry-run")
    report = json.loads(out)
    assert (status, err, report.keys()) == (0, "", KEYS)
    assert report["voxels"].keys() == {"height_m", "overlap_before", "overlap_after"}
    assert 0 < report["voxels"]["overlap_before"] < 1
    assert report["evaluations"] > 2
    before = format_model(load_session(placed).people[0].model)
    status, out, _ = run(*words, "--voxels-only", "--json")
    alone = json.loads(out)
    assert (status, alone["evaluations"]) == (0, 0)
    assert alone["height_m"] == alone["voxels"]["height_m"]
    assert before != alone["model"] == format_model(load_session(placed).people[0].model)
    out = output_of(run(*words, "--dry-run"))
    assert "voxels: " in out
    assert "evaluations" in out


@pytest.mark.slow
def test_wrong_input(run, placed):
    before = files_of(placed)
    for words, expected in (
        (("--views", "FRONT", "RIGHT"), "--views with --paper alone"),
        (("--paper", "--views", "FRONT"), "found 'FRONT'"),
        (("--paper", "--views", "FRONT", "FRONT"), "found 'FRONT FRONT'"),
        (("--paper", "--views", "FRONT", "TOP"), "two of FRONT, RIGHT, BACK, LEFT"),
        (("--paper", "--views", "FRONT", "BACK", "--frames", "20:21"), "FRONT and BACK show the person"),
        (("--n-frames", "0"), "at least 1"),
        (("--paper", "--method", "voxels"), "--paper with --method contours"),
        (("--voxels-only",), "--voxels-only with --method voxels"),
        (("--out", "body.json"), "a .toml file"),
        (("--out", "nowhere/body.toml"), "a folder that exists"),
        (("--frames", "3:9"), "place the body in the page"),
    ):
        assert_refused(run("acquire", placed, *words), [expected])
        assert files_of(placed) == before


def test_a_person_s_body_that_cannot_be_used(run, tmp_path):
    body = tmp_path / "ann.toml"
    body.write_text(format_model(load_model("gavrila34", 1.6)))
    for more, expected in (
        (("--person-model", tmp_path / "no.toml"), "expected --person-model as a .toml file"),
        (("--person-model", "gavrila34"), "found 'gavrila34'"),
        (("--person-model", body, "--people", "ann", "bob"), "found ann, bob"),
        (("--person-model", body, "--height", "1.7"), "without --height"),
        (("--person-model", body, "--model", "gavrila22"), "without --model"),
    ):
        assert_refused(new_session(run, tmp_path / "s", *more), [expected])
        assert not (tmp_path / "s").exists()
