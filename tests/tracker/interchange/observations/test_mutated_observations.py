"""Mutated observations of each format: each is imported or refused by one sentence."""

import multiprocessing
import random
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path

import joint_files
import numpy as np
import pytest
from mask_files import SIZE, person_masks, write_coco_masks, write_masks
from mutation import mutated, tried
from observed_files import write_c3d, write_coco_images, write_deeplabcut, write_points_csv, write_sleap
from observed_people import BODY_25, make_session, seen, walking, write_openpose
from program_files import WRITERS

from tracker.footage.recording import read_mask
from tracker.formats.bvh import BvhFrame, write_bvh
from tracker.formats.joint_tables.layouts import LAYOUTS, find_layout
from tracker.formats.keypoints import hdf5
from tracker.formats.observation_layout import Sample
from tracker.formats.trc import write_trc
from tracker.geometry import rigid
from tracker.interchange.observations.importing import plan_import, store_import
from tracker.interchange.observations.observed import observed_joints
from tracker.interchange.observations.plans import ImportRequest
from tracker.interchange.observations.readers import FORMATS
from tracker.interchange.observations.stored import load_observations
from tracker.interchange.observations.stored_masks import load_masks

N = 4
TRUTH = walking(N)
KINDS = {
    "openpose": ("k/cam1/cam1_000000000002_keypoints.json", None), "coco": ("c.json", None), "deeplabcut csv":
    ("d/cam0.csv", None), "deeplabcut h5": ("d/cam0.h5", "h5py"), "sleap": ("s/cam0.slp", "sleap_io"), "analysis":
    ("s/cam0.h5", "sleap_io"), "nwb": ("s/cam0.nwb", "sleap_io"), "trc": ("a.trc", None), "csv": ("a.csv", None), "bvh":
    ("a.bvh", None), "c3d": ("a.c3d", "ezc3d"), **{f"joints {kind}": (name, None) for kind, name in
    joint_files.KINDS.items() if kind != "wide"}, "masks": ("m/cam1/cam1_000002.png", None), "coco polygon": ("c.json",
    None), "coco runs": ("c.json", None), "coco text": ("c.json", "pycocotools"), "easymocap":
    ("f/annots/cam1/000002.json", None), "mmpose": ("f/cam1.json", None), "mmpose pictures": ("f/cam1/000002.json",
    None), "alphapose": ("f/cam1/alphapose-results.json", None), "roboflow": ("f/_annotations.coco.json", None),
    "label studio": ("f/project-1.json", None), "cvat images": ("f/cam1.xml", None), "cvat video": ("f/cam1.xml", None),
    "yolo": ("f/cam1/cam1_000002.txt", None), "sleap csv": ("f/labels.v001.000_cam1.analysis.csv", None), "eks":
    ("f/multicam_cam1_results.csv", None), "hand labels": ("f/labeled-data/cam1/CollectedData_ann.csv", None),
    "masks by object": ("m/cam1/mask_00002_obj1.png", None), "stored masks": ("masks.toml", None), "stored text":
    ("observations.toml", None), "stored numbers": ("points.npz", None)
}  # fmt: skip
"""For each kind: the file that is mutated, and the package that it needs."""
OF_JOINTS = ("trc", "c3d", "bvh", "csv", *(kind for kind in KINDS if kind.startswith("joints ")))
OF_MASKS = ("masks", "masks by object", "coco polygon", "coco runs", "coco text", "stored masks")
APART = ("h5py", "sleap_io")
"""Packages that read in a process of their own."""
SECONDS = 10.0
"""Time of that process for a file, s: damaged files may hang."""


def write(kind, session, folder):
    """Write the files of a kind; return the path to import."""
    if kind in ("masks", "stored masks"):
        return write_masks(folder / "m", session.camera_names, person_masks(N, 4))
    if kind == "masks by object":
        for k in (1, 2):
            write_masks(folder / f"m{k}", session.camera_names, person_masks(N, 4), f"mask_{{k:05d}}_obj{k}.png")
        shutil.copytree(folder / "m2", folder / "m1", dirs_exist_ok=True)
        return (folder / "m1").rename(folder / "m")
    if kind in OF_MASKS:
        return write_coco_masks(folder / "c.json", session.camera_names, person_masks(N, 4), kind.split()[1])
    points = seen(session, [TRUTH])
    if kind.startswith("joints "):
        n_points = 19 if kind == "joints panoptic" else 25
        of_one = TRUTH[None, :, :n_points]
        return joint_files.write_joints(kind.removeprefix("joints "), folder, BODY_25.points[:n_points], of_one)
    if kind in WRITERS:
        WRITERS[kind](folder / "f", session.camera_names, list(BODY_25.points), points)
    elif kind == "openpose":
        write_openpose(folder / "k", session.camera_names, points)
    elif kind == "coco":
        write_coco_images(folder / "c.json", session.camera_names, BODY_25.points, points, "scores")
    elif kind.startswith("deeplabcut"):
        write_deeplabcut(folder / "d" / "cam0", BODY_25.points, points[:, 0], kind.split()[1])
    elif kind in ("sleap", "analysis", "nwb"):
        write_sleap(folder / KINDS[kind][0], BODY_25.points, points[:, 0])
    elif kind == "trc":
        write_trc(folder / "a.trc", BODY_25.points, TRUTH, 30.0)
    elif kind == "csv":
        write_points_csv(folder / "a.csv", BODY_25.points, TRUTH, 30.0, "m")
    elif kind == "bvh":
        model = session.people[0].model
        upright = BvhFrame(rigid.transform(np.eye(3), np.array([0.0, 0.0, 1.14])), np.eye(3), 100.0)
        write_bvh(folder / "a.bvh", model, np.repeat(model.neutral()[None], N, axis=0), 30.0, upright)
    else:
        write_c3d(folder / "a.c3d", BODY_25.points, TRUTH, 30.0)
    return folder / KINDS[kind][0].split("/", maxsplit=1)[0]


def read(kind, session, path, case):
    """Import, or load what was imported; return whether it was refused."""
    if kind == "stored masks":
        load_masks(session, "mp")
        return False
    if kind.startswith("stored"):
        observations = load_observations(session, "mp")
        observed_joints(observations, [c.camera for c in session.cameras])
        return False
    plan = plan_import(session, ImportRequest(f"m{case}", (path,), ("ann",), unit_m=_unit(kind)))
    if kind in OF_MASKS:
        if not plan.problems and case % 10 == 0:
            used = store_import(session, plan)
            for source in used.cameras:
                read_mask(source, 2)
        return bool(plan.problems)
    observed_joints(plan.observations, [c.camera for c in session.cameras])
    if not plan.problems and case % 10 == 0:
        store_import(session, plan)
        load_observations(session, f"m{case}")
    return bool(plan.problems)


def _unit(kind):
    """Metres per unit that the user gives: those of the file, so that points lie before the cameras."""
    return (1.0 if kind.startswith("joints ") else 0.01) if kind in OF_JOINTS else None


def run_forked(words, **_):
    """Read a file in a fork of this process, which has loaded the libraries: a new one needs 2 to 7 s for that."""
    path, folder = map(Path, words[-2:])
    child = multiprocessing.get_context("fork").Process(target=hdf5.main, args=(path, folder))
    child.start()
    child.join(SECONDS)
    if child.is_alive():
        child.kill()
        child.join()
        raise subprocess.TimeoutExpired("fork", SECONDS)


def test_a_file_of_each_row_of_the_tables_is_mutated(tmp_path):
    session, formats, layouts = make_session(tmp_path / "session", N, size=SIZE), set(), set()
    for i, (kind, (name, package)) in enumerate(KINDS.items()):
        path = tmp_path / str(i) / name
        if kind.startswith("stored"):
            continue
        if package is None and kind != "bvh":  # which takes a second to write
            path.parents[name.count("/")].mkdir()
            write(kind, session, path.parents[name.count("/")])
        else:  # known by its name, if not by that of another kind
            path.parent.mkdir(parents=True)
            path.touch()
        sample = Sample(path)
        formats |= {next((key for key, row in FORMATS.items() if row.recognizes(sample)), "")}
        layouts |= {find_layout(sample)}
    assert formats - {""} == FORMATS.keys()
    assert layouts - {None} == {*LAYOUTS}


@pytest.mark.parametrize(
    ("kind", "n"),
    [
        pytest.param(kind, n, marks=[pytest.mark.slow] if n > 50 or package in APART else [])
        for kind, (_, package) in KINDS.items()
        for n in ((1000,) if package in APART or kind in WRITERS else (20 if kind.startswith("joints ") else 50, 1000))
    ],
)
def test_mutated_observations_are_imported_or_refused(kind, n, tmp_path, monkeypatch):
    name, package = KINDS[kind]
    if package is not None:
        pytest.importorskip(package)
    session = make_session(tmp_path / "session", N, size=SIZE if kind in OF_MASKS else (640, 480))
    folder = tmp_path / "files"
    folder.mkdir()
    path = write("openpose" if kind in ("stored text", "stored numbers") else kind, session, folder)
    if package in APART:
        assert not read(kind, session, path, 1)  # by a process of its own
        hdf5.read_hdf5(folder / name)  # loads the libraries
        monkeypatch.setattr(hdf5.subprocess, "run", run_forked)
    if kind.startswith("stored"):
        store_import(session, plan_import(session, ImportRequest("mp", (path,), ("ann",))))
        folder = session.folder / "observations" / "mp"
    data = (folder / name).read_bytes()
    rng, failures, refused = random.Random(f"mutated {kind}"), [], 0
    for case in range(n):
        (folder / name).write_bytes(mutated(rng, name, data, [data]))
        refused += tried(case, partial(read, kind, session, path, case), failures)
    sys.stderr.write(f"{kind}: {n} mutated files, {refused} refused, {len(failures)} failures\n")
    assert not failures, "\n".join(failures[:5])
    assert 0 < refused < n  # neither all are refused nor all are read
