"""First poses that a file gives are stored as keyframes, or refused before anything is written."""

from dataclasses import replace

import numpy as np
import pytest

from tracker.errors import Remedy, TrackerError
from tracker.estimation.posing.default_pose import default_pose
from tracker.evaluation.references import read_joints
from tracker.formats.pose_csv import PoseTable
from tracker.pipeline.given_pose import set_pose_at_joints, set_pose_from_table
from tracker.session.store.annotation_store import AnnotationStore


@pytest.fixture
def joints(session):
    return read_joints(session.folder / "truth.trc", session.fps)


def keyframes(session):
    with AnnotationStore(session.annotations_path) as store:
        return {row.frame: row.source for row in store.frames(session.people[0].name)}


def test_a_pose_at_joints_is_a_keyframe_near_them(session, joints):
    given = set_pose_at_joints(session, 0, 5, joints, fit_sizes=False)
    assert np.mean([*given.residuals_mm.values()]) < 30
    assert all(view.n_inside for view in given.views)
    assert keyframes(session) == {5: "imported"}


@pytest.mark.parametrize(
    ("frames", "factor", "remedy"),
    [(slice(0, 3), 1.0, "frame_of_file"), (slice(None), 100.0, "read_in_unit")],
    ids=["no such row", "centimetres"],
)
def test_joints_that_cannot_be_used_leave_the_session_as_it_was(session, joints, frames, factor, remedy):
    rows = {name: getattr(joints, name)[frames] for name in ("frames", "times")}
    joints = replace(joints, **rows, points=factor * joints.points[frames])
    with pytest.raises(TrackerError) as refused:
        set_pose_at_joints(session, 0, 5, joints, fit_sizes=True)
    assert refused.value.remedy == Remedy(remedy)
    assert keyframes(session) == {}


def test_a_table_of_another_body_is_refused_by_the_names_that_differ(session):
    model = session.people[0].model
    names = ("tail", *model.value_names[1:])
    poses = np.tile(default_pose(model, [c.camera for c in session.cameras]), (3, 1))
    table = PoseTable("cat", 0.3, names, np.arange(3), poses)
    with pytest.raises(TrackerError, match=r"found 'cat'.*with tail") as refused:
        set_pose_from_table(session, 0, 1, table)
    assert refused.value.remedy == Remedy("body_of_table")
    set_pose_from_table(session, 0, 1, replace(table, model=model.name, value_names=model.value_names))
    assert keyframes(session) == {1: "imported"}
