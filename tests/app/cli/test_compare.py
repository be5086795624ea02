"""`quadrille compare`: two scripted annotators of one session, apart; its JSON, table and report; what it refuses."""

import csv
import json
import shutil
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from bodies import MODELS
from command_line import assert_refused, output_of
from stored_motions import put_poses, random_poses, store_motion

from tracker.estimation.fitting.gauss_newton import PointTargets, solve
from tracker.formats.joint_maps import JOINTS
from tracker.formats.trc import read_trc
from tracker.session.session import Person, create_session
from tracker.session.store.annotation_store import AnnotationStore

N, BIAS_M = 30, 0.008
MODEL = MODELS["gavrila22"]
POSES = random_poses(MODEL, N, seed=7)
POSES[:, MODEL.value_names.index("left_elbow.extension")] = 1.2  # a bent arm can swivel


def annotate(folder, person, poses, model=MODEL, keyframe=True):
    """Store poses by frame as an annotator's work."""
    with AnnotationStore(folder / "annotations.sqlite") as store:
        source = "manual" if keyframe else "tracked"
        put_poses(store, Person(person, model, ""), poses, source, "Annotate", keyframe=keyframe)


def with_elbow_off(pose):
    """Swivel the left arm of a pose so that its elbow lies 8 mm off, and its wrist where it was."""
    shoulder, elbow, wrist = (MODEL.point_names.index(f"left_{j}") for j in ("shoulder", "elbow", "wrist"))
    points = MODEL.points_world(pose)
    across = np.cross(points[wrist] - points[shoulder], points[elbow] - points[shoulder])
    points[elbow] += BIAS_M * across / np.linalg.norm(across)
    active = np.array([name.startswith("left_") for name in MODEL.dof_names])
    held = np.array([shoulder, elbow, wrist])
    return solve(MODEL, pose, [PointTargets(held, points[held], np.full(3, 1000.0))], active).pose


def center(pose, joint):
    return MODEL.joint_centers_world(pose)[MODEL.point_names.index(joint)]


@pytest.fixture
def apart(tmp_path):
    """Two copies of a session; each annotator has noise of 0.2 degrees, and the second an elbow that is 8 mm off."""
    session, _ = store_motion(tmp_path / "ann", [MODEL], n_frames=N, gaps=[(0, f) for f in range(N)])
    shutil.copytree(session.folder, tmp_path / "ben")
    rng, sigma = np.random.default_rng(1), np.where(MODEL.dof_is_length, 0.0005, np.radians(0.2))
    biased = [with_elbow_off(p) for p in POSES]
    work = {}
    for name, poses in (("ann", POSES), ("ben", biased)):
        work[name] = [MODEL.retract(p, sigma * rng.normal(size=MODEL.n_dofs)) for p in poses]
        annotate(tmp_path / name, "ann", dict(enumerate(work[name])))
    known = np.array([center(b, "left_elbow") - center(a, "left_elbow") for a, b in zip(POSES, biased, strict=True)])
    return tmp_path, work, known


def test_known_bias_limits_and_icc_come_back(run, apart):
    folder, work, known = apart
    status, out, err = run("compare", folder / "ann", folder / "ben", "--json")
    assert (status, err) == (0, "")
    report = json.loads(out)
    elbow = report["joints"]["left_elbow"]
    assert np.linalg.norm(known.mean(axis=0)) > 0.9 * BIAS_M
    off = np.linalg.norm(np.subtract(elbow["bias_mm"], 1000 * known.mean(axis=0)))
    assert off < 0.1 * 1000 * BIAS_M

    places = np.array([[1000 * center(p, "left_elbow") for p in work[name]] for name in ("ann", "ben")])
    along = (places[1] - places[0]) @ (elbow["bias_mm"] / np.linalg.norm(elbow["bias_mm"]))
    half = 1.959964 * np.sqrt(((along - along.mean()) ** 2).sum() / (N - 1))
    assert elbow["limits_mm"] == pytest.approx([along.mean() - half, along.mean() + half], rel=1e-6)
    places = places.transpose(1, 0, 2)
    assert elbow["icc"] == pytest.approx(covariance_icc(places), abs=1e-6)
    assert elbow["icc_by_axis"] == pytest.approx([covariance_icc(places[..., [i]]) for i in range(3)], abs=1e-6)
    assert (elbow["n"], report["n"], set(report["joints"])) == (N, N, set(JOINTS))

    dof = MODEL.dof_names.index("left_elbow.extension")
    angles = np.degrees([[p[MODEL.dof_value[dof]] for p in work[name]] for name in ("ann", "ben")])
    angle = report["angles"]["left_elbow.extension"]
    assert angle["icc"] == pytest.approx(covariance_icc(angles.T[..., None]), abs=1e-6)
    assert angle["bias_deg"] == pytest.approx((angles[1] - angles[0]).mean(), abs=1e-6)
    assert angle["icc_interval"][0] < angle["icc"] < angle["icc_interval"][1]
    assert set(report["annotators"]) == {"ann", "ben"}


@pytest.mark.slow
def test_the_consensus_has_less_error_than_either(run, apart):
    """Written by one command, and both annotators and the consensus measured against the poses that they aimed at."""
    folder, work, _ = apart
    path = folder / "consensus.trc"
    assert run("compare", folder / "ann", folder / "ben", "--consensus", path)[0] == 0
    table = read_trc(path)
    joints = [MODEL.point_names.index(j) for j in table.names]
    truth, *annotated = (
        np.array([MODEL.joint_centers_world(p)[joints] for p in poses]) for poses in (POSES, work["ann"], work["ben"])
    )
    assert (table.frames - 1).tolist() == list(range(N))
    assert np.allclose(table.points, np.mean(annotated, axis=0), atol=1e-6)
    of_consensus, *errors = (np.linalg.norm(x - truth, axis=-1).mean() for x in (table.points, *annotated))
    assert of_consensus < min(errors)
    report = json.loads(run("evaluate", folder / "ann", "--reference", path, "--json")[1])
    own = json.loads(run("compare", folder / "ann", folder / "ben", "--json")[1])["annotators"]["ann"]["joints"]
    assert report["per_joint_mm"]["left_elbow"] == pytest.approx(own["left_elbow"]["mean_mm"], rel=1e-4)
    assert_refused(run("compare", folder / "ann", folder / "ben", "--consensus", path), ["--consensus at a path"])


def covariance_icc(values):
    """ICC(A,1) of two annotators, (n, 2, d), by covariances: 2 cov / (var + var + squared bias), less its own noise."""
    a, b = values[:, 0], values[:, 1]
    n = len(values)
    covariance = sum(np.cov(x, y)[0, 1] for x, y in zip(a.T, b.T, strict=True))
    variances = a.var(axis=0, ddof=1).sum() + b.var(axis=0, ddof=1).sum()
    of_bias = ((a - b).mean(axis=0) ** 2).sum() - (a - b).var(axis=0, ddof=1).sum() / n
    return 2 * covariance / (variances + of_bias)


def test_text_table_and_report(run, apart):
    folder, _, _ = apart
    table, report = folder / "t.csv", folder / "r.html"
    words = ("compare", folder / "ann", folder / "ben", "--tolerance", "1", "--csv", table, "--report", report)
    out = output_of(run(*words))
    assert "30 poses by ann, ben; differences: second less first" in out
    assert "30 of 30 poses differ by more than 1 mm:" in out
    assert "and 20 more; --json lists all" in out
    rows = list(csv.DictReader(table.open(encoding="utf-8")))
    found = json.loads(run("compare", folder / "ann", folder / "ben", "--json")[1])
    (elbow,) = (r for r in rows if (r["quantity"], r["name"]) == ("joint", "left_elbow"))
    assert [float(elbow[k]) for k in ("lower_limit", "upper_limit")] == pytest.approx(
        found["joints"]["left_elbow"]["limits_mm"], rel=1e-4
    )
    assert len(rows) == 4 * len(JOINTS) + len(found["angles"])
    text = report.read_text("utf-8")
    assert text.count("<svg") == 12
    assert "Differences: ben less ann. " in text
    assert "http" not in text
    assert_refused(run(*words), ["expected --csv at a path that is free"])
    assert run(*words, "--overwrite")[0] == 0
    assert_refused(run(*words[:-2], "--overwrite", "--report", folder / "no" / "r.html"), ["cannot write", "r.html"])


@pytest.mark.slow
def test_keyframes_or_all_poses_of_one_or_more_people_and_annotators(run, tmp_path):
    session, _ = store_motion(tmp_path / "a", [MODEL, MODELS["gavrila34"]], n_frames=8)
    for other in ("b", "c"):
        shutil.copytree(session.folder, tmp_path / other)
    for name, person in product("abc", ("ann", "bob")):
        body = MODEL if person == "ann" else MODELS["gavrila34"]
        tracked = dict(enumerate(random_poses(body, 8, seed=ord(name))))
        annotate(tmp_path / name, person, tracked, body, keyframe=False)
        annotate(tmp_path / name, person, {k: tracked[k] for k in (2, 5)}, body)
    three = [tmp_path / name for name in "abc"]
    report = json.loads(run("compare", *three, "--report", tmp_path / "r.html", "--json")[1])
    a, b = report["joints"]["left_knee"]["annotators"]
    assert f"left knee ({a}, {b})" in (tmp_path / "r.html").read_text("utf-8")
    assert (report["n"], set(report["people"]), len(report["pairs"])) == (4, {"ann", "bob"}, 3)
    assert report["people"]["bob"]["joints"]["neck"]["n"] == 2
    assert set(report["joints"]["neck"]["annotators"]) < set("abc")
    assert_refused(
        run("compare", *three, "--consensus", tmp_path / "c.trc"), ["one person with --consensus, found ann, bob"]
    )
    report = json.loads(run("compare", *three[:2], "--poses", "all", "--person", "bob", "--json")[1])
    assert report["n"] == 8
    assert "people" not in report
    assert {d["person"] for d in report["worst"]} == {"bob"}


def test_bodies_may_differ(run, tmp_path):
    session, _ = store_motion(tmp_path / "a", [MODEL], n_frames=4)
    shutil.copytree(session.folder, tmp_path / "b")
    annotate(tmp_path / "a", "ann", dict(enumerate(POSES[:4])))
    taller = MODEL.with_height(1.1 * MODEL.height_m)
    annotate(tmp_path / "b", "ann", dict(enumerate(POSES[:4])), taller)
    report = json.loads(run("compare", tmp_path / "a", tmp_path / "b", "--json")[1])
    assert report["notes"] == ["the bodies of 'ann' have different sizes, and distances of joints include them"]
    assert report["joints"]["left_wrist"]["mean_distance_mm"] > 10
    assert all(a["bias_deg"] == 0 for a in report["angles"].values())
    annotate(tmp_path / "b", "ann", dict(enumerate(random_poses(MODELS["gavrila34"], 4, 1))), MODELS["gavrila34"])
    report = json.loads(run("compare", tmp_path / "a", tmp_path / "b", "--json")[1])
    assert (report["angles"], len(report["notes"])) == ({}, 2)


def test_sessions_of_other_recordings_are_refused(run, tmp_path):
    a, _ = store_motion(tmp_path / "a", [MODEL], n_frames=4)
    assert_refused(run("compare", a.folder), ["expected at least two sessions"])
    assert_refused(run("compare", a.folder, a.folder), ["expected different session folders", "twice"])
    store_motion(tmp_path / "longer", [MODEL], n_frames=5)
    assert_refused(run("compare", a.folder, tmp_path / "longer"), ["copies of one session", "frames 4", "5"])
    store_motion(tmp_path / "more", [MODEL, MODEL], n_frames=4)
    assert_refused(run("compare", a.folder, tmp_path / "more"), ["people ann in", "ann, bob"])
    cameras = [replace(c, camera=replace(c.camera, name=f"{c.camera.name}b")) for c in a.cameras]
    create_session(tmp_path / "other", cameras=cameras, people=a.people, fps=a.fps, n_frames=4, up="z")
    assert_refused(run("compare", a.folder, tmp_path / "other"), ["copies of one session", "cameras"])
    shutil.copytree(a.folder, tmp_path / "empty")
    (tmp_path / "empty" / "annotations.sqlite").unlink()
    assert_refused(run("compare", a.folder, tmp_path / "empty"), ["a and empty have a keyframe", "found none"])
    assert_refused(run("compare", a.folder, tmp_path / "empty", "--tolerance=-1"), ["--tolerance", "-1"])
