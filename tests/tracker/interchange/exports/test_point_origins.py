"""Where each joint of a stored pose comes from, through edits of several people."""

from dataclasses import replace

import pytest
from bodies import MODELS
from stored_motions import store_motion

from tracker.interchange.exports.provenance import point_origins
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import SEEN, MarkChange, Pin, PoseChange

MODEL = MODELS["gavrila38"]


@pytest.fixture
def edited(tmp_path):
    """A tracked pose: anna sets the left shoulder, ben the right one, anna confirms it; returns its versions."""
    session, _ = store_motion(tmp_path / "s", [MODEL], n_frames=2)
    with AnnotationStore(session.annotations_path) as store:
        for author, side in (("anna", "left"), ("ben", "right")):
            record = store.pose("ann", 0)
            is_own = [name.startswith(f"{side}_shoulder") for name in MODEL.value_names]
            pairs = zip(is_own, record.sources, strict=True)
            sources = tuple("manual" if own else old for own, old in pairs)
            values = record.values.copy()
            values[is_own] += 0.1
            seen = {f"{side}_elbow": {"FRONT": [1.0, 2.0]}}
            settings = {SEEN: {**record.settings.get(SEEN, {}), **seen}}
            changed = replace(record, values=values, sources=sources, settings=settings)
            store.commit(f"drag by {author}", [PoseChange("ann", 0, changed)], author=author)
        store.commit("confirm", [MarkChange("ann", 0, keyframe=True, reviewed=True)], author="anna")
        yield store.pose_versions("ann", 0)


def test_each_joint_names_who_set_it_last_and_in_which_views(edited):
    pins = [Pin("left_elbow", "LEFT", (3.0, 4.0)), Pin("left_knee", "BACK", (5.0, 6.0))]
    found = dict(zip(MODEL.point_names, point_origins(MODEL, edited, pins), strict=True))
    left, right, knee = (found[name] for name in ("left_elbow", "right_elbow", "left_knee"))
    assert (left.source, left.author, left.views) == ("manual", "anna", ("FRONT", "LEFT"))
    assert (right.source, right.author, right.views) == ("manual", "ben", ("FRONT",))
    assert (knee.source, knee.views) == ("tracked", ("BACK",))
    assert knee.author not in ("anna", "ben")
    assert left.time == edited[2].time


def test_versions_end_where_the_frame_was_empty_and_with_another_body(edited):
    assert [record.author for record in edited[:3]] == ["anna", "ben", "anna"]
    other_body = [*edited[:2], replace(edited[2], model_revision=99), *edited[3:]]
    found = dict(zip(MODEL.point_names, point_origins(MODEL, other_body), strict=True))
    assert found["left_elbow"].author == "ben"  # made in this body then
