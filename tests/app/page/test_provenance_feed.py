"""Which page receives where a pose comes from, and what it says."""

import shutil

import pytest
from gestures import drag

from app.messages.observation import AnnotatorsMessage, OtherCopyMessage, ProvenanceMessage, WatchProvenance
from app.page.feeds.provenance import ProvenanceFeed
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import BETWEEN, SEAM, PoseChange, PoseRecord


@pytest.fixture
def controller(session, opened):
    """Frame 0 is dragged by hand; frame 1 is tracked between two keyframes, frame 2 imported, frame 3 empty."""
    controller = opened()
    values = controller.state.poses[0]
    with AnnotationStore(session / "annotations.sqlite") as store:

        def record(source, **more):
            return PoseRecord(values, (source,) * len(values), 1, **more)

        settings = {"method": "contour", BETWEEN: [0, 15], SEAM: 12.34}
        limbs_lost = (0.25, *(0.0,) * 4)
        store.commit(
            "run",
            [
                PoseChange("person", 1, record("tracked", settings=settings, limbs_lost=limbs_lost)),
                PoseChange("person", 2, record("imported", remark="by mediapipe")),
            ],
            author="",
        )
    controller = opened()
    drag(controller, "left_wrist", (12.0, -8.0))
    return controller


def asked(controller, frame, person=0, annotators=False):
    controller.navigation.seek(frame)
    feed = ProvenanceFeed()
    feed.watch(WatchProvenance(person, annotators))
    assert feed.is_due(controller.state)
    return {type(message): message for message in feed.updates(controller, controller.state)}


def test_nothing_is_read_for_a_page_that_does_not_ask(controller):
    feed = ProvenanceFeed()
    feed.updates(controller, controller.state)
    assert not feed.is_due(controller.state)
    controller.navigation.seek(1)
    assert not feed.is_due(controller.state)
    feed.watch(WatchProvenance(0))
    assert feed.is_due(controller.state)
    assert [type(m) for m in feed.updates(controller, controller.state)] == [ProvenanceMessage]
    assert not feed.is_due(controller.state)
    feed.watch(WatchProvenance(None))
    assert feed.updates(controller, controller.state) == []


def test_a_dragged_joint_names_its_view(controller):
    found = asked(controller, 0)[ProvenanceMessage]
    points = {p.point: p for p in found.points}
    assert (found.source, found.keyframe, found.calibration_revision) == ("manual", True, 1)
    assert (points["left_wrist"].source, points["left_wrist"].views) == ("manual", ("FRONT",))
    assert points["right_knee"].views == ()


def test_a_tracked_pose_names_its_method_and_keyframes_an_imported_one_its_set(controller):
    tracked = asked(controller, 1)[ProvenanceMessage]
    assert (tracked.method, tracked.between, tracked.seam_mm) == ("contour", (0, 15), 12.34)
    assert {p.lost for p in tracked.points} >= {0.25, None}
    imported = asked(controller, 2)[ProvenanceMessage]
    assert (imported.source, imported.imported_from, imported.keyframe) == ("imported", "mediapipe", False)
    assert asked(controller, 3)[ProvenanceMessage].source is None


def test_keyframes_are_listed_by_annotator_for_the_filter(controller):
    assert AnnotatorsMessage not in asked(controller, 0)
    ((by,),) = [list(of.values()) for of in asked(controller, 0, annotators=True)[AnnotatorsMessage].people]
    assert by == (0,)


def test_the_other_copy_is_described_until_the_comparison_ends(controller, session, tmp_path):
    ben = shutil.copytree(session, tmp_path / "ben")
    feed = ProvenanceFeed()
    assert feed.updates(controller, controller.state) == []
    controller.other_copies.open(ben)
    (found,) = feed.updates(controller, controller.state)
    assert (found.name, found.tolerance_mm, found.posed) == ("ben", 20.0, (True,))
    assert [(d.frame, d.distance_mm) for d in found.people[0]] == [(0, 0.0)]
    controller.other_copies.set_tolerance(0.005)
    assert feed.updates(controller, controller.state)[0].tolerance_mm == 5.0
    controller.other_copies.leave()
    assert [m.name for m in feed.updates(controller, controller.state) if isinstance(m, OtherCopyMessage)] == [""]
