"""`quadrille next` and `track --between-keyframes` from end to end: what they print, and what they refuse."""

import json

import numpy as np
import pytest
from command_line import SAMPLE, assert_refused, output_of

from tracker.body.limbs import limb_display_name, limbs
from tracker.formats.model_toml import format_model
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange, PoseRecord

FRAMES = range(20, 29)


def pose(folder, limb, frame, sigma_m):
    """Store poses with small errors, and with a limb on one frame that has a large one."""
    (person,) = load_session(folder).people
    own = next(x for x in limbs(person.model) if limb_display_name(x.name) == limb)
    values = person.model.neutral()
    with AnnotationStore(folder / "annotations.sqlite") as store:
        revision = store.add_model_revision(person.name, format_model(person.model))
        for k in FRAMES:
            sigmas = np.full(len(person.model.point_names), 0.006)
            if k == frame:
                sigmas[np.isin(person.model.point_parts, own.parts)] = sigma_m
            errors = np.eye(3) * (sigmas**2)[:, None, None]
            record = PoseRecord(values, ("tracked",) * len(values), revision, errors=errors)
            store.commit("pose", [PoseChange(person.name, k, record)])


def test_next_names_frame_limb_and_view(run, session):
    pose(session, "left arm", 24, 0.1)
    status, out, err = run("next", session, "--json", "--count", "3")
    found = json.loads(out)
    assert (status, err) == (0, "")
    assert (found["frame"], found["person"], found["limb"], found["frames"]) == (24, "person", "left arm", [24, 24])
    assert found["view"] == found["views"][0]
    assert found["reason"].startswith(f"left arm, frame 24, seen best in {found['view']}: ")
    assert 0 < found["expected_gain_mm"] < found["expected_error_mm"] - found["best_achievable_mm"] + 1e-6
    low, high = found["interval_mm"]
    assert low < found["expected_error_mm"] < high
    assert found["next"][0] == {k: v for k, v in found.items() if k in found["next"][0]}
    out = output_of(run("next", session))
    assert f"frame 24: {found['reason']}; gains " in out


def test_next_says_where_nothing_is_left_that_pays(run, session):
    pose(session, "left arm", 24, 0.006)
    report = json.loads(run("next", session, "--json")[1])
    assert (report["frame"], report["view"], report["expected_gain_mm"], report["next"]) == (None, None, 0.0, [])
    assert report["reason"] == "nothing is left that pays"
    assert run("next", session)[1].startswith("nothing is left that pays: expected error ")


def test_refusals_of_next_and_between_keyframes(run, session):
    assert_refused(run("next", session), ["expected poses to improve, found none"])
    assert_refused(run("next", session, "--count", "0"), ["expected --count as a whole number from 1, found 0"])
    words = ("track", session, "--between-keyframes")
    assert_refused(run(*words), ["expected two keyframes with other frames between them in frames 0 to 49, found none"])
    assert_refused(run(*words, "--backward"), ["expected --between-keyframes without --init"])
    assert_refused(run(*words, "--no-whole-run"), ["expected a backward pass with --between-keyframes"])


@pytest.mark.slow
def test_only_stretches_whose_keyframes_changed_are_tracked_again(run, session):
    def set_keyframe(k):
        assert run("init", session, "--joints", SAMPLE / "truth.trc", "--frame", k)[0] == 0

    def tracked(*options):
        report = json.loads(output_of(run("track", session, "--between-keyframes", "--json", *options)))
        return [(s["first"], s["last"], s["people"]) for s in report["stretches"]], report["runs"]

    for k in (20, 23, 26):
        set_keyframe(k)
    stretches, (only,) = tracked()
    assert stretches == [(20, 23, ["person"]), (23, 26, ["person"])]
    assert only["frames"] == 7
    assert tracked() == ([], [])
    assert "nothing to track" in run("track", session, "--between-keyframes")[1]
    set_keyframe(28)
    assert tracked()[0] == [(26, 28, ["person"])]
    per_frame = json.loads(run("evaluate", session, "--reference", SAMPLE / "truth.trc", "--json")[1])["per_frame"]
    seams = {e["frame"]: e["seam_mm"] for e in per_frame}
    assert [k for k, seam in seams.items() if seam is None] == [20, 23, 26, 28]
    assert all(0 <= seam < 60 for seam in seams.values() if seam is not None)


@pytest.mark.slow
def test_the_voxel_tracker_runs_between_keyframes(run, session):
    for k in (20, 24):
        assert run("init", session, "--joints", SAMPLE / "truth.trc", "--frame", k)[0] == 0
    out = output_of(run("track", session, "--between-keyframes", "--method", "voxel", "--json"))
    assert [(s["first"], s["last"]) for s in json.loads(out)["stretches"]] == [(20, 24)]
    result = json.loads(run("evaluate", session, "--reference", SAMPLE / "truth.trc", "--json")[1])
    assert [e["frame"] for e in result["per_frame"]] == [20, 21, 22, 23, 24]
    assert result["lost_frames"] == 0
