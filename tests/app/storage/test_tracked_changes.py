import numpy as np
from fake_tracker import Estimate

from app.storage.tracked_changes import tracked_changes
from tracker.store.annotation_store import AnnotationStore
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.estimate import OtherPose


def test_what_is_about_as_good_goes_to_the_store_with_the_pose(tmp_path):
    store = AnnotationStore(tmp_path / "annotations.sqlite")
    revisions = [store.add_model_revision(name, "a = 1") for name in ("man", "woman")]
    other = OtherPose(np.array([7.0, 8.0]), 1.25)
    found = Estimate(
        4, (np.zeros(2), np.ones(2)), 1.0, np.ones(4), 9, ("good", "doubtful"), ("", "left arm may be elsewhere"),
        (np.ones(3),) * 2, (np.eye(2),) * 2, ((), (other,)),
    )  # fmt: skip
    changes = tracked_changes([found], ["man", "woman"], [0, 1], revisions, {}, TrackSettings())
    store.commit("track", changes, by_program=True)
    assert store.alternatives("man", 4) == ()
    (kept,) = store.alternatives("woman", 4)
    np.testing.assert_array_equal(kept.values, other.values)
    assert (kept.model_revision, kept.cost_px) == (revisions[1], 1.25)
    # A keyframe that the tracker was given is not written at all.
    assert [c.person for c in tracked_changes([found], ["man", "woman"], [0, 1], revisions, {4: {1: np.ones(2)}},
                                              TrackSettings())] == ["man"]  # fmt: skip
    store.close()
