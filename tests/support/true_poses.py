"""The sample session with its true poses stored, as if they were tracked."""

import shutil

from command_line import SAMPLE

from tracker.formats.model_toml import format_model, load_model
from tracker.formats.pose_csv import read_pose_table
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange, PoseRecord


def sample_with_poses(folder, n):
    """Copy the sample to a folder; its poses repeat in n frames. Frame 0 is a keyframe, 2 and 3 are doubtful."""
    session = load_session(shutil.copytree(SAMPLE, folder))
    table = read_pose_table(SAMPLE / "truth.csv")
    model = load_model(SAMPLE / "truth_model.toml", table.height_m)
    poses = table.values_for(model)
    with AnnotationStore(session.annotations_path) as store:
        revision = store.add_model_revision("person", format_model(model))
        records = [
            PoseRecord(
                poses[k % len(poses)], ("tracked",) * len(poses[0]), revision, keyframe=k == 0,
                status="doubtful" if k in (2, 3) else "good", remark="left arm uncertain" if k in (2, 3) else "",
            )
            for k in range(n)
        ]  # fmt: skip
        store.commit("Track", [PoseChange("person", k, record) for k, record in enumerate(records)])
    return session
