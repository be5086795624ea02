"""Mutated observations of each format: each is imported or refused by one sentence."""

import random
import sys
import traceback
import warnings

import numpy as np
import pytest
from mutation import json_bytes, mutate_bytes, mutate_tree
from observed_files import (
    write_bvh_chain,
    write_c3d,
    write_coco_images,
    write_deeplabcut,
    write_points_csv,
    write_sleap,
)
from observed_people import BODY_25, make_session, seen, walking, write_openpose

from tracker.errors import TrackerError
from tracker.formats.keypoints import hdf5
from tracker.formats.trc import write_trc
from tracker.observations.importing import plan_import, store_import
from tracker.observations.joints import observed_joints
from tracker.observations.request import ImportRequest
from tracker.observations.stored import load_observations

N = 4
TRUTH = walking(N)
KINDS = {
    "openpose": ("k/cam1/cam1_000000000002_keypoints.json", None),
    "coco": ("c.json", None),
    "deeplabcut csv": ("d/cam0.csv", None),
    "deeplabcut h5": ("d/cam0.h5", "h5py"),
    "sleap": ("s/cam0.slp", "sleap_io"),
    "analysis": ("s/cam0.h5", "sleap_io"),
    "nwb": ("s/cam0.nwb", "sleap_io"),
    "trc": ("a.trc", None),
    "csv": ("a.csv", None),
    "bvh": ("a.bvh", None),
    "c3d": ("a.c3d", "ezc3d"),
}
"""For each kind: the file that is mutated, and the package that it needs."""
APART = ("h5py", "sleap_io")
"""Packages that read in a process of their own, which takes two seconds to start."""


def write(kind, session, folder):
    """Write the files of a kind; return the path to import."""
    points = seen(session, [TRUTH])
    if kind == "openpose":
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
        write_bvh_chain(folder / "a.bvh")
    else:
        write_c3d(folder / "a.c3d", BODY_25.points, TRUTH, 30.0)
    return folder / KINDS[kind][0].split("/")[0]


def mutated(rng, name, data):
    if name.endswith(".json") and rng.random() < 0.5:
        import json

        return json_bytes(mutate_tree(rng, json.loads(data)))
    for _ in range(rng.choice((1, 1, 1, 1, 2, 4))):
        data = mutate_bytes(rng, data, [data]) or b" "
    return data


@pytest.mark.parametrize(
    ("kind", "n"),
    [
        pytest.param(kind, n, marks=[pytest.mark.slow] if n > 50 or package in APART else [])
        for kind, (_, package) in KINDS.items()
        for n in ((100,) if package in APART else (50, 1000))
    ],
)
def test_mutated_observations_are_imported_or_refused(kind, n, tmp_path, monkeypatch):
    monkeypatch.setattr(hdf5, "SECONDS", 10.0)  # damaged files may hang
    name, package = KINDS[kind]
    if package is not None:
        pytest.importorskip(package)
    session = make_session(tmp_path / "session", N)
    folder = tmp_path / "files"
    folder.mkdir()
    path = write(kind, session, folder)
    data, cameras = (folder / name).read_bytes(), [c.camera for c in session.cameras]
    rng, failures, refused = random.Random(f"mutated {kind}"), [], 0
    for case in range(n):
        (folder / name).write_bytes(mutated(rng, name, data))
        try:
            with warnings.catch_warnings(), np.errstate(all="ignore"):
                warnings.simplefilter("ignore")
                plan = plan_import(session, ImportRequest(f"m{case}", (path,), ("ann",), unit_m=0.01))
                refused += bool(plan.problems)
                observed_joints(plan.observations, cameras)
                if not plan.problems and case % 10 == 0:
                    store_import(session, plan)
                    load_observations(session, f"m{case}")
        except TrackerError as error:
            refused += 1
            if len(str(error)) > 2000:
                failures.append(f"case {case}: a message of {len(str(error))} characters: {str(error)[:300]}")
        except Exception:
            failures.append(f"case {case}: {traceback.format_exc(limit=-3)}")
    sys.stderr.write(f"{kind}: {n} mutated files, {refused} refused, {len(failures)} failures\n")
    assert not failures, "\n".join(failures[:5])
    assert refused
