"""What the inspector shows and changes: settings, the 3-D view and body sizes, by messages of a page."""

import json
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from gestures import drag

from app.control.tracking import track_settings
from app.messages.parsing import MessageError, parse
from app.page.commands import dispatch
from app.page.feeds.inspector import InspectorFeed
from tracker.body.dimensions import dimensions_of
from tracker.body.limbs import Search
from tracker.errors import TrackerError
from tracker.session.store.records import PoseChange, PoseRecord


@pytest.fixture
def page(opened):
    return Page(opened())


class Page:
    """A page whose messages are carried out at once."""

    def __init__(self, controller):
        self.controller, self.feed = controller, InspectorFeed()

    def send(self, kind, **fields):
        dispatch(self.controller, 1, parse(json.dumps({"type": kind, **fields})))

    def updates(self):
        """The messages that it has not received yet, by type."""
        news = self.feed.updates(self.controller, self.controller.state)
        return {message.__struct_config__.tag: message for message in news}


def test_settings_are_shown_changed_one_by_one_and_their_defaults_known(page):
    first = page.updates()["settings"]
    assert (first.track, first.search) == (first.track_default, first.search_default)
    page.send("track_settings", changes={"options": {"estimate": "search", "order": "2", "recover": False}})
    page.send("track_settings", changes={"options": {"window": 5}})
    page.send("search_settings", changes={"bound_rad": 0.5, "theta_px": 25, "passes": [1, 0.5]})
    shown = page.updates()["settings"]
    settings = page.controller.state.settings
    assert (settings.estimate, settings.recover, settings.whole_run) == ("search", None, True)
    assert (settings.predict.order, settings.predict.window) == (2, 5)
    assert shown.track.options == {"estimate": "search", "order": "2", "window": 5, "recover": False}
    assert (shown.search.bound_rad, shown.search.theta_px, shown.search.passes) == (0.5, 25, (1, 0.5))
    assert shown.search.step_rad == first.search.step_rad
    page.send("track_settings", changes={"options": {"recover": True, "order": None}})
    assert page.controller.state.settings.recover is not None
    assert page.updates()["settings"].track.options == {"estimate": "search", "window": 5}
    for options, expected in (
        ({"window": 9}, "a whole number from 1 to 8 as 'window', found 9"),
        ({"window": 2.5}, "a whole number from 1 to 8"),
        ({"order": "7"}, "one of 0, 1, 2 as 'order', found '7'"),
        ({"recover": 1}, "true or false as 'recover'"),
        ({"voxel_size": True}, "a number from 10 to 100"),
        ({"speed": 1}, "an option among estimate, order"),
    ):
        with pytest.raises(TrackerError, match=expected):
            page.send("track_settings", changes={"options": options})
    with pytest.raises(TrackerError, match="a tracking method among chamfer, contour, voxel, found 'sonar'"):
        page.send("track_settings", changes={"method": "sonar"})


@pytest.mark.slow
def test_track_settings_are_kept_with_the_session(page, opened):
    page.send("track_settings", changes={"options": {"estimate": "search", "order": "2", "recover": False}})
    page.send("track_settings", changes={"method": "voxel", "options": {"whole_run": False, "voxel_size": 25}})
    page.send("search_settings", changes={"bound_rad": 0.5})
    chosen = page.updates()["settings"]
    page.controller = opened()
    again = Page(page.controller)
    shown = again.updates()["settings"]
    assert shown.track == chosen.track != chosen.track_default
    assert shown.search == chosen.search_default  # those of a search are for trials
    assert track_settings.of_run(again.controller.state.settings, again.controller.state.run_choices).voxel_m == 0.025
    none = dict.fromkeys(shown.track.options)
    again.send("track_settings", changes=msgspec.to_builtins(chosen.track_default) | {"options": none})
    assert Page(opened()).updates()["settings"].track == chosen.track_default


@pytest.mark.slow
def test_stride_and_cameras_are_kept_and_only_known_cameras_taken(page, opened):
    names = page.controller.session.camera_names
    page.send("track_settings", changes={"stride": 4, "cameras": [names[2], names[0]]})
    shown = page.updates()["settings"].track
    assert (shown.stride, shown.cameras) == (4, (names[0], names[2]))
    with pytest.raises(TrackerError, match="unknown camera 'roof'"):
        page.send("track_settings", changes={"cameras": ["roof"]})
    with pytest.raises(MessageError, match=r"a whole number >= 1 as 'changes.stride'"):
        page.send("track_settings", changes={"stride": 0})
    again = Page(opened())
    assert again.updates()["settings"].track == shown
    again.send("track_settings", changes={"cameras": list(names)})
    assert again.updates()["settings"].track.cameras == ()  # all of them


@pytest.mark.slow
@pytest.mark.parametrize(
    "kept",
    [
        3, {"order": 7}, {"window": "2"}, {"estimate": "guess"}, {"later": True}, ["order"], {"stride": 0},
        {"cameras": ["roof"]},
    ],
)  # fmt: skip
def test_kept_settings_that_cannot_be_used_are_passed_over(opened, kept):
    opened().session_state.saver.store_setting("track_settings", kept)
    settings = Page(opened()).updates()["settings"]
    assert settings.track == settings.track_default


@pytest.mark.parametrize("switched_off", ["backward_pass", "audit", "smooth"])
def test_settings_of_former_versions_are_read(opened, switched_off):
    kept = {"method": "contour", "order": 2, "past_poses": 5, "estimate": "search", switched_off: False}
    opened().session_state.saver.store_setting("track_settings", kept)
    state = opened().state
    assert (state.settings.estimate, state.settings.predict.order, state.settings.predict.window) == ("search", 2, 5)
    run = track_settings.of_run(state.settings, state.run_choices)
    assert (run.method, run.predict.order, run.predict.window, run.whole_run) == ("contour", 2, 5, False)


def test_the_3d_view_is_chosen_and_kept_with_the_session(page, opened):
    assert not page.updates()["view_3d"].view.ghost
    page.send("view_3d", changes={"floor": False, "opacity": 0.4, "trail_points": ["head"], "trail_frames": 30})
    updates = page.updates()
    assert set(updates) == {"view_3d"}  # nothing else changed
    view = updates["view_3d"].view
    assert (view.floor, view.bodies, view.opacity, view.trail_points) == (False, True, 0.4, {"head"})
    assert "head" in updates["view_3d"].trail_points
    with pytest.raises(MessageError, match=r"a number >= 0\.1 as 'changes.opacity'"):
        page.send("view_3d", changes={"opacity": 0})
    with pytest.raises(MessageError, match=r"knossow54.* as 'changes.character'"):
        page.send("view_3d", changes={"character": "nobody"})
    page.send("view_3d", changes={"character": "knossow54"})
    assert "knossow54" in page.updates()["view_3d"].characters
    view = page.controller.state.view_3d
    assert view.character == "knossow54"
    page.controller.view_3d.note_prediction("from frame 3")
    assert page.updates()["view_3d"].prediction == "from frame 3"
    page.controller = opened()
    assert Page(page.controller).updates()["view_3d"].view == view


def test_sizes_become_a_draft_and_then_a_body_that_can_be_undone(page):
    before = page.updates()["body_sizes"]
    page.send("body_sizes", action="part", person=0, part="left_forearm", length_m=0.29)
    page.send("body_sizes", action="width", person=0, girdle="shoulder", width_m=0.41)
    updates = page.updates()["body_sizes"]
    parts = {part.name: part for part in updates.parts}
    was = {part.name: part for part in before.parts}
    assert updates.edited
    assert parts["right_forearm"].length_m == pytest.approx(0.29)  # both sides alike
    assert parts["left_forearm"].half_depth_m == pytest.approx(was["left_forearm"].half_depth_m)
    assert {w.name: w.width_m for w in updates.widths}["shoulder"] == pytest.approx(0.41)
    page.send("body_sizes", action="apply", person=0, refit=True)
    updates = page.updates()["body_sizes"]
    assert (updates.edited, updates.has_former, before.has_former) == (False, True, False)
    assert "Applied" in updates.outcome
    page.controller.history.undo()
    assert {p.name: p.length_m for p in page.updates()["body_sizes"].parts} == pytest.approx(
        {p.name: p.length_m for p in before.parts}
    )


def test_sides_are_edited_alone_and_a_draft_is_discarded(page):
    page.send("body_sizes", action="couple", on=False)
    page.send("body_sizes", action="part", person=0, part="left_calf", half_width_m=0.07)
    parts = dimensions_of(page.controller.body_sizes.model(0)).parts
    assert parts["left_calf"].girths_m[1] == pytest.approx(0.07)
    assert parts["right_calf"].girths_m[1] != pytest.approx(0.07)
    page.send("body_sizes", action="discard", person=0)
    assert not page.updates()["body_sizes"].edited


WRONG = {
    "a height of 30 to 300 cm": {"action": "height", "height_m": 9.0},
    "a part of the body": {"action": "part", "part": "tail", "length_m": 0.3},
    "a girdle of the body": {"action": "width", "girdle": "ear", "width_m": 0.3},
    "length of head to be 0.5 to": {"action": "part", "part": "head", "length_m": 9.0},
    "sizes that person had before": {"action": "previous"},
    "other sizes of person": {"action": "apply", "refit": False},
}


def test_a_person_moves_to_another_body_and_back(page):
    """Locks, the selected joint and keyframes follow; the next message names the body."""
    controller = page.controller
    drag(controller, "left_wrist", (6.0, -9.0))
    before, frame = controller.state.people[0].values, controller.state.frame
    wrist = controller.models[0].named_points_world(before)["left_wrist"]
    sizes = page.updates()["body_sizes"]
    assert (sizes.body, "gavrila38" in sizes.bodies) == ("gavrila22", True)
    elbow = controller.models[0].dof_names.index("right_elbow.extension")
    page.send("pose", action="lock", frame=frame, person=0, dofs=[elbow], locked=True)
    page.send("body_sizes", action="body", person=0, to="gavrila38")
    told = page.updates()["body_sizes"]
    assert told.body == "gavrila38"
    assert "left_foot" in [part.name for part in told.parts]
    assert told.outcome.startswith("person has the body gavrila38, 1 pose refitted.")
    (model,) = controller.models
    body = model.named_points_world(controller.state.people[0].values)
    assert np.linalg.norm(body["left_wrist"] - wrist) < 0.03
    assert [model.dof_names[i] for i in controller.state.locked[0]] == ["right_elbow.extension"]
    record = controller.session_state.saver.record(0, frame)
    assert (record.keyframe, len(record.values)) == (True, len(model.value_names))
    page.send("select", person=0, point="left_toe")
    controller.history.undo()
    assert (page.updates()["body_sizes"].body, controller.state.point) == ("gavrila22", None)
    np.testing.assert_array_equal(controller.state.people[0].values, before)
    names = controller.models[0].dof_names
    assert [names[i] for i in controller.state.locked[0]] == ["right_elbow.extension"]
    with pytest.raises(TrackerError, match="found gavrila22 again"):
        page.send("body_sizes", action="body", person=0, to="gavrila22")
    with pytest.raises(MessageError, match="expected one of gavrila22"):
        page.send("body_sizes", action="body", person=0, to="/etc/passwd")


def test_wrong_sizes_are_refused_in_a_sentence_and_limits_are_those_that_are_checked(page):
    for expected, message in WRONG.items():
        with pytest.raises(TrackerError, match=expected):
            page.send("body_sizes", person=0, **message)
    assert page.controller.state.draft is None
    sizes = page.updates()["body_sizes"]
    for length_m in sizes.size_limits_m:
        page.send("body_sizes", action="part", person=0, part="left_calf", length_m=length_m)
    page.send("body_sizes", action="discard", person=0)
    for height_m in sizes.height_limits_m:
        page.send("body_sizes", action="height", person=0, height_m=height_m)


def test_the_searches_on_a_frame_are_shown_from_the_store(page):
    """In words; of a pose of an earlier version they are not known."""
    controller = page.controller
    state, saver = controller.state, controller.session_state.saver
    values = np.array(state.people[0].values)
    record = PoseRecord(values, ("tracked",) * len(values), saver.revisions.current(0))
    trace = (
        Search("limbs", ("left_forearm", "right_calf"), 41.0, 12.0, True),
        Search("samples", (), 12.0, 11.5, False),
        Search("repair", ("left_calf",), -8.0, None, False),
        Search("path", ("left_forearm",), 20.0, 9.5, True),
        Search("path", (), 3.0, 1.0, True),
    )
    for frame, known in ((state.frame, trace), (state.frame + 1, ())):
        saver.write("track", [PoseChange("person", frame, replace(record, trace=known))], None, by_program=True)
    saver.write("track", [PoseChange("person", state.frame + 2, record)], None, by_program=True)
    found = []
    for frame in range(state.frame, state.frame + 3):
        controller.session_state.show_frame(frame=frame)
        found.append(page.updates()["reason"].tried)
    assert [(x.what, x.before_nats, x.after_nats, x.taken) for x in found[0]] == [
        ("left arm and right leg", 41.0, 12.0, True),
        ("samples around the pose", 12.0, 11.5, False),
        ("left leg, by colours of the run", -8.0, None, False),
        ("left arm, by all frames together", 20.0, 9.5, True),
        ("pose, by all frames together", 3.0, 1.0, True),
    ]
    assert found[1:] == [(), None]
