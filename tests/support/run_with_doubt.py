"""The bundled sample as a tracked run, with an arm that is wrong on one frame."""

import numpy as np

from tracker.body.limbs import Search, limbs
from tracker.formats.model_toml import format_model
from tracker.formats.pose_csv import read_pose_table
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import Alternative, PoseChange, PoseRecord

WRONG_FRAME = 20
DOUBTED = "left_forearm"
"""The last part of the limb that is wrong."""


def store_run(folder):
    """Store the true poses as a tracked run. On one frame the left arm is wrong, and its true pose an alternative."""
    session = load_session(folder)
    model, truth = session.people[0].model, read_pose_table(folder / "truth.csv").values
    names = [x.name for x in limbs(model)]
    arm = names.index(DOUBTED)
    store = AnnotationStore(session.annotations_path)
    revision = store.add_model_revision("person", format_model(model))
    changes = []
    for frame, values in enumerate(truth):
        pose = PoseRecord(values, ("tracked",) * len(values), revision, status="good", cost_px=1.0, trace=())
        changes.append(PoseChange("person", frame, pose))
    step = np.where(limbs(model)[arm].dofs, 0.9, 0.0)
    wrong = model.clip(model.retract(truth[WRONG_FRAME], step))
    lost = tuple(0.6 if i == arm else 0.001 for i in range(len(names)))
    pose = PoseRecord(
        wrong, ("tracked",) * len(wrong), revision, status="lost", cost_px=2.0, limbs_lost=lost,
        remark="left arm uncertain",
        trace=(
            Search("limbs", (DOUBTED,), 41.2, 12.4, True),
            Search("repair", (DOUBTED, "left_calf"), -320.1, None, False),
        ),
    )  # fmt: skip
    alternative = Alternative(truth[WRONG_FRAME], revision, 2.5)
    changes[WRONG_FRAME] = PoseChange("person", WRONG_FRAME, pose, (alternative,))
    store.commit("track frames 0:50", changes)
    store.close()
    return session
