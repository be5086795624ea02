"""A person moved to another body: sizes that correspond are kept, keyframes fitted, and one undo brings it back."""

import shutil

import numpy as np
import pytest
from stored_motions import put_poses

from tracker.body.dimensions import dimensions_of, with_dimensions, with_sizes_of
from tracker.errors import TrackerError
from tracker.formats.model_toml import format_model, load_model
from tracker.pipeline.body_acquisition import SIZES_EDITS
from tracker.pipeline.body_change import change_body
from tracker.session.session import load_session, save_model
from tracker.session.store.annotation_store import AnnotationStore

FRAMES = {0: ("manual", True), 3: ("searched", False), 4: ("tracked", False)}


def grown():
    """The body without feet, with sizes of its own."""
    model = load_model("gavrila34", 1.7)
    sizes, rng = dimensions_of(model), np.random.default_rng(0)
    parts = {
        n: p._replace(length_m=p.length_m * rng.uniform(0.9, 1.1), girths_m=tuple(g * 1.1 for g in p.girths_m))
        for n, p in sizes.parts.items()
    }
    return with_dimensions(model, sizes._replace(parts=parts))


@pytest.fixture
def session(tmp_path, sample_folder):
    loaded = load_session(shutil.copytree(sample_folder, tmp_path / "session"))
    return save_model(loaded, 0, grown())


@pytest.fixture
def store(session):
    """A keyframe, a found pose, and a tracked one."""
    store, (person,) = AnnotationStore(session.annotations_path), session.people
    model = person.model
    for frame, (source, is_keyframe) in FRAMES.items():
        step = np.random.default_rng(frame).normal(0, 0.2, model.n_dofs)
        values = model.clip(model.retract(model.neutral(), step))
        put_poses(store, person, {frame: values}, source, "pose", keyframe=is_keyframe, status="doubtful", trace=())
    yield store
    store.close()


def poses(store):
    return {k: store.pose("person", k) for k in FRAMES}


def test_feet_are_added_and_all_other_sizes_and_joints_stay(session, store):
    before, model = poses(store), session.people[0].model
    found = change_body(session, store, 0, "gavrila38")
    body = load_session(session.folder).people[0].model
    assert (body.name, format_model(body)) == ("gavrila38", format_model(found.body))
    own, other = dimensions_of(body), dimensions_of(model)
    assert own.height_m == other.height_m
    assert own.widths_m == pytest.approx(other.widths_m)
    assert own.parts.keys() - other.parts.keys() == {"left_foot", "right_foot"}
    for name, sizes in other.parts.items():
        assert own.parts[name].length_m == pytest.approx(sizes.length_m)
        assert own.parts[name].girths_m == pytest.approx(sizes.girths_m)
    assert (found.n_refitted, found.n_kept) == (2, 1)
    assert found.off_m < 1e-4
    after = poses(store)
    for k in (0, 3):
        one, again = (m.points_world(p.values) for m, p in ((model, before[k]), (body, after[k])))
        at = [model.point_names.index(n) for n in ("left_wrist", "right_ankle", "left_ankle", "head")]
        there = [body.point_names.index(n) for n in ("left_wrist", "right_ankle", "left_ankle", "head")]
        np.testing.assert_allclose(again[there], one[at], atol=1e-4)
    ankle = body.value_names.index("left_ankle.flexion")
    assert (after[0].sources[ankle], after[0].sources[0]) == ("fitted", "manual")
    assert (after[0].keyframe, after[0].status, after[0].trace) == (True, "", None)
    assert (after[3].keyframe, after[3].status, after[3].sources[0]) == (False, "doubtful", "searched")
    np.testing.assert_array_equal(after[4].values, before[4].values)  # tracked: it stays in its body
    assert after[4].model_revision == before[4].model_revision
    (changed,) = store.setting(SIZES_EDITS).values()
    assert [name for name, *_ in changed] == ["person"]
    assert store.undo() == "body of person: gavrila38"
    for k, record in poses(store).items():
        np.testing.assert_array_equal(record.values, before[k].values)


def test_back_to_a_body_without_feet(session, store):
    change_body(session, store, 0, "gavrila38")
    changed = change_body(load_session(session.folder), store, 0, "gavrila34")
    assert format_model(changed.body) == format_model(load_session(session.folder).people[0].model)
    for name, sizes in dimensions_of(session.people[0].model).parts.items():
        assert dimensions_of(changed.body).parts[name].length_m == pytest.approx(sizes.length_m)
    assert changed.off_m < 1e-4


def test_a_rigid_trunk_gives_no_sizes_to_one_that_bends():
    rigid = load_model("gavrila22", 1.7)
    sizes = dimensions_of(rigid)
    arm, trunk = sizes.parts["left_upper_arm"], sizes.parts["torso"]
    parts = {"left_upper_arm": arm._replace(length_m=0.4), "torso": trunk._replace(length_m=0.7)}
    person = with_dimensions(rigid, sizes._replace(parts={**sizes.parts, **parts}))
    dimensions = dimensions_of(with_sizes_of(load_model("gavrila38"), person))
    assert dimensions.parts["left_upper_arm"].length_m == pytest.approx(0.4)
    assert dimensions.parts["torso"] == dimensions_of(load_model("gavrila38", 1.7)).parts["torso"]


def test_the_same_body_is_refused_and_nothing_is_written(session, store):
    n = len(store.history())
    for name, expected in (("gavrila34", "found gavrila34 again"), ("gavrila99", "not found: expected one of")):
        with pytest.raises(TrackerError, match=expected):
            change_body(session, store, 0, name)
    assert len(store.history()) == n
