"""The pane socket of a real controller: what a page is told, and what it may ask for."""

import asyncio

import cv2
import numpy as np
import pytest
from gestures import drag
from page_visits import visiting

from app.messages import encoding
from app.messages.parsing import MISUNDERSTOOD
from app.page.feeds.pictures import PictureSets


@pytest.fixture
def controller(placed):
    return placed


@pytest.fixture
async def page(controller):
    async with visiting(controller) as page:
        yield page


def curves_of(message):
    """Frames and curves by name of the plot and the curve."""
    frames = np.frombuffer(message["payload"], "<u4", message["count"])
    values = np.frombuffer(message["payload"], "<f4", offset=4 * message["count"]).reshape(-1, message["count"])
    names = [(plot["title"], label) for plot in message["plots"] for label in plot["labels"]]
    assert len(names) == len(values)
    return frames.tolist(), dict(zip(names, values, strict=True))


@pytest.mark.slow
async def test_a_page_is_told_all_when_it_connects(page):
    session = await page.hear("session")
    assert session["people"][0]["parts"][0] == "torso"
    state = await page.hear("state")
    assert (state["frame"], state["source"], state["status"], state["part_costs_px"]) == (2, "manual", "", [])
    assert state["track"]["first"] is None
    assert state["follow"]
    timeline = await page.hear("timeline")
    assert timeline["replace"]
    assert timeline["cells"].keys() == {"2"}
    assert not [m for m in page.told if m["type"] == "curves"]  # only for those who ask


@pytest.mark.slow
async def test_a_run_is_watched_frame_by_frame(tracker, page):
    await page.hear("timeline")
    await page.send("track", action="forward", until=6)
    await page.hear("state", lambda m: m["track"]["running"] and m["track"]["total"] == 4)
    tracker.let_go(2)
    state = await page.hear("state", lambda m: m["frame"] == 4)
    assert (state["status"], state["remark"]) == ("doubtful", "left arm relocated")
    assert state["part_costs_px"] == [0.5] * 9 + [None]
    assert [cost > 0 for cost in state["view_costs_px"]] == [True] * 4  # of the pose that is shown, by all edges
    await page.hear("overlay", lambda m: m["frame"] == 4)
    for camera in range(4):
        image = await page.hear("image", lambda m: m["frame"] == 4)
        assert image["camera"] == camera
    tracker.let_go(2)
    await page.hear("state", lambda m: m["track"]["message"].startswith("done"))
    cells = {k: c for m in page.told if m["type"] == "timeline" for k, c in m["cells"].items()}
    cells |= (await page.hear("timeline", lambda m: "6" in m["cells"]))["cells"] if "6" not in cells else {}
    assert cells["4"]["status"] == "doubtful"
    assert cells["4"]["remark"] == "left arm relocated"


@pytest.mark.slow
async def test_images_come_though_the_tracker_is_ahead_by_then(controller, tracker, page):
    """A tracker that is faster than the pictures must not leave the panes without any."""
    await page.hear("timeline")
    image = controller.frames.image

    def overtaken(*args):
        tracker.let_go(1)
        return image(*args)

    controller.frames.image = overtaken
    await page.send("track", action="forward", until=None)
    tracker.let_go(1)
    frames = [(await page.hear("image"))["frame"] for _ in range(8)]
    assert len(set(frames)) >= 2


async def test_pause_go_on_follow_and_stop(tracker, page):
    await page.hear("timeline")
    await page.send("track", action="forward", until=None)
    tracker.let_go(2)
    await page.hear("state", lambda m: m["track"]["at"] == 4)
    await page.send("seek", frame=3)
    await page.hear("state", lambda m: m["frame"] == 3 and not m["follow"])
    await page.send("follow", follow=True)
    await page.hear("state", lambda m: m["frame"] == 4 and m["follow"])
    going = asyncio.create_task(go_on_slowly(tracker))
    await page.send("track", action="pause")
    state = await page.hear("state", lambda m: not m["track"]["running"])
    assert state["track"]["first"] == 3
    await page.send("track", action="resume")
    await page.hear("state", lambda m: m["track"]["running"])
    await page.send("track", action="stop")
    await page.hear("state", lambda m: m["track"]["message"].startswith("stopped"))
    going.cancel()


async def go_on_slowly(tracker):
    """A pause waits for the present step, which must come to its end."""
    while True:
        await asyncio.sleep(0.2)
        tracker.let_go(1)


@pytest.mark.slow
async def test_an_impossible_run_is_a_notice(controller, caplog):
    async with visiting(controller) as page:
        await page.send("track", action="backward", until=40)
        notice = await page.hear("notice")
        assert notice["level"] == "error"
        assert "frames to track before frame 2" in notice["text"]
        await page.send("curves", group="ears")
        assert (await page.hear("notice"))["text"] == MISUNDERSTOOD
    assert "as 'group', found 'ears'" in caplog.text


@pytest.mark.slow
async def test_a_tracker_that_fails_is_said_once(controller, tracker):
    tracker.fails_at = 4
    async with visiting(controller) as page:
        await page.hear("timeline")
        await page.send("track", action="forward", until=None)
        tracker.let_go(2)
        said = await page.hear("advice", lambda m: m["said"] and m["said"][0]["situation"] == "run_failed")
        assert "no light" in said["said"][0]["text"]
        await page.send("select", person=0, point="head")
        await page.hear("state", lambda m: m["point"] == "head")
        assert page.told[page.told.index(said) + 1 :].count(said) == 0


@pytest.mark.slow
async def test_curves_come_whole_and_then_as_they_change(controller, tracker, page):
    await page.hear("timeline")
    await page.send("curves", group="torso")
    message = await page.hear("curves")
    assert (message["replace"], message["group"], message["person"]) == (True, "torso", 0)
    frames, curves = curves_of(message)
    assert frames == [2]
    assert curves["Position", "x"][0] == pytest.approx(100 * controller.state.poses[0][0], abs=1e-3)
    await page.send("track", action="forward", until=4)
    tracker.let_go(2)
    seen = {}
    while 4 not in seen:
        message = await page.hear("curves")
        assert not message["replace"]
        frames, curves = curves_of(message)
        seen |= dict(zip(frames, curves["Position", "x"], strict=True))
    assert 2 not in seen
    assert seen[4] - seen[3] == pytest.approx(1.0, abs=1e-3)  # the fake walks a centimetre a frame
    await page.send("undo")
    message = await page.hear("curves")
    frames, curves = curves_of(message)
    assert frames == [3, 4]
    assert np.all(np.isnan(curves["Position", "x"]))


async def test_another_group_replaces_the_first_and_closed_ones_rest(controller, page):
    await page.send("curves", group="arms")
    await page.hear("curves")
    await page.send("curves", group="cost")
    message = await page.hear("curves")
    assert (message["group"], message["replace"]) == ("cost", True)
    assert message["plots"][0]["labels"] == ["mean", "FRONT", "RIGHT", "BACK", "LEFT"]
    await page.send("curves", group=None)
    await page.send("select", person=0, point="head")  # carried out after it
    await page.hear("state", lambda m: m["point"] == "head")
    count = len(page.told)
    drag(controller, "left_knee", (4.0, 0.0))
    await page.hear("timeline")
    await asyncio.sleep(0.2)
    await page.send("select", person=0, point="head")
    await page.hear("state", lambda m: m["point"] == "head")
    assert not [m for m in page.told[count:] if m["type"] == "curves"]


@pytest.mark.slow
async def test_a_drag_means_the_frame_that_the_hand_saw(controller):
    controller.navigation.seek(5)
    async with visiting(controller) as page:
        await page.hear("timeline")
        hold = {"camera": 0, "person": 0, "point": "torso", "u": 320.0, "v": 240.0, "frame": 2}
        await page.send("drag", phase="start", seq=1, **hold)
        await page.hear("state", lambda m: m["frame"] == 2)
        await page.send("drag", phase="end", seq=2, **(hold | {"u": 330.0}))
        await page.hear("state", lambda m: m["undo"] == "drag torso, frame 2")


@pytest.mark.slow
async def test_segments_are_sent_when_the_evidence_has_come(page):
    await page.hear("timeline")
    await page.shows("image", "accepted", "rejected")
    await page.hear("overlay", lambda m: "rejected" in kinds(m))
    await page.send("seek", frame=30)
    message = await page.hear("overlay", lambda m: m["frame"] == 30 and "rejected" in kinds(m))
    assert {p["camera"] for p in message["paths"] if p["kind"] == "accepted"} == {0, 1, 2, 3}


def kinds(message):
    return {p["kind"] for p in message["paths"]}


async def test_a_range_is_worked_on_and_told(page):
    await page.hear("inconsistent", lambda m: m["frames"] == [])
    await page.send("seek", frame=6)
    await page.send("mark", toggle="keyframe")
    await page.hear("timeline", lambda m: m["cells"].get("6", {}).get("keyframe"))
    await page.send("range", action="interpolate", first=2, last=6, person=None)
    cells = (await page.hear("timeline"))["cells"]
    assert {k: (c["source"], c["reviewed"]) for k, c in cells.items()} == dict.fromkeys("345", ("interpolated", False))
    # The state may be told before the cells, or after.
    if not any(m["type"] == "state" and m["range"]["message"] == "interpolated 3 frames" for m in page.told):
        await page.hear("state", lambda m: m["range"]["message"] == "interpolated 3 frames")
    await page.send("range", action="reviewed", first=3, last=4, person=0)
    assert set((await page.hear("timeline"))["cells"]) == {"3", "4"}
    await page.send("range", action="fold", first=3, last=4, person=0)
    assert (await page.hear("notice"))["text"] == MISUNDERSTOOD
    await page.send("range", action="interpolate", first=10, last=12, person=None)
    assert "poses at both ends" in (await page.hear("notice"))["text"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "fields"),
    [
        ("pin", {"frame": 2, "camera": 0, "person": 0, "point": "left_wrist", "u": 100.0, "live": True}),
        ("pin", {"frame": "two", "camera": 0, "person": 0, "point": "left_wrist", "u": 1, "v": 1, "live": 1}),
        ("pin", {"frame": 2, "camera": 0, "person": 0, "point": "left_wrist", "u": "NaN", "v": 1, "live": True}),
        ("unpin", {"frame": 2, "person": 0, "point": "left_wrist"}),
        ("unpin", {"frame": 2, "person": "ann", "point": None, "camera": None}),
        ("fit", {}),
        ("fit", {"frame": 2, "person": 7}),
        ("search", {"action": "frame", "person": -1}),
        ("people", {"action": "show", "person": 4, "shown": False}),
        ("people", {"action": "dim"}),
        ("pose", {"action": "copy_person", "frame": 2, "person": 0}),
    ],
)  # fmt: skip
async def test_a_message_not_understood_changes_nothing(controller, kind, fields):
    before = controller.state
    async with visiting(controller) as page:
        await page.send(kind, **({"phase": "start"} if kind == "pin" else {}), **fields)
        assert (await page.hear("notice"))["text"] == MISUNDERSTOOD  # whose user typed no key of it
    now = controller.state
    assert (now.pins, now.people, now.undo, now.visibility) == (
        before.pins,
        before.people,
        before.undo,
        before.visibility,
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("data", "binary"),
    [
        (b"{", False), (b"\xff\xfe", False), (b'{"type":"seek"}', True), (b"[" * 100_000, False),
        (b'{"type":"seek","frame":1e400}', False), (b'{"frame":1}', False),
        (b'{"type":"seek","frame":' + b"[" * 100_000, False),
    ],
)  # fmt: skip
async def test_a_wrong_message_is_one_notice_and_the_socket_stays_open(controller, caplog, data, binary):
    async with visiting(controller) as page:
        await page.hear("timeline")
        await page.send_raw(data, binary)
        assert (await page.hear("notice"))["text"] == MISUNDERSTOOD
        await page.seek(7)
        assert len([m for m in page.told if m["type"] == "notice"]) == 1
    (record,) = caplog.records
    assert record.getMessage().startswith("a page sent a wrong message: expected ")


@pytest.mark.slow
async def test_a_fault_of_the_program_is_a_notice(controller, monkeypatch):
    monkeypatch.setattr(controller.history, "undo", lambda: 1 / 0)
    async with visiting(controller) as page:
        await page.send("undo")
        assert "ZeroDivisionError" in (await page.hear("notice"))["text"]
        await page.seek(7)


async def test_many_cells_travel_as_columns(controller, monkeypatch):
    controller.navigation.seek(6)
    controller.ranges.toggle_keyframe()
    controller.ranges.interpolate(2, 6)
    controller.ranges.mark(4, 4, "reviewed")
    named = controller.stored_poses.timeline()
    monkeypatch.setattr(encoding, "_FEW_CELLS", 0)
    async with visiting(controller) as page:
        message = await page.hear("cells")
        n, payload = message["count"], message["payload"]
        assert (n, message["replace"], len(payload)) == (5, True, 5 * 11)
        assert np.frombuffer(payload, "<u4", n).tolist() == [2, 3, 4, 5, 6]
        costs = np.frombuffer(payload, "<f4", n, 4 * n)
        source, status, marks = np.frombuffer(payload, np.uint8, 3 * n, 8 * n).reshape(3, n)
        for k, frame in enumerate(range(2, 7)):
            cell = named[frame]
            assert message["sources"][source[k]] == cell["source"]
            assert message["statuses"][status[k]] == cell["status"]
            assert marks[k] == cell["keyframe"] + 2 * cell["reviewed"]
            assert costs[k] == pytest.approx(cell["cost_px"]) if cell["cost_px"] else np.isnan(costs[k])
        await page.send("undo")
        await page.send("undo")
        gone = await page.hear("cells", lambda m: not m["replace"] and m["count"] == 3)
        assert np.frombuffer(gone["payload"], np.uint8, 3, 8 * 3).tolist() == [255] * 3


async def test_pictures_of_a_frame_come_as_sets_of_the_size_asked_for(controller, observer):
    observer.forget()
    async with visiting(controller) as page:
        await page.hear("timeline")
        await page.shows("image", "distance", "silhouette", "parts", reductions=(1, 1.6, 0, 4))
        await page.send("seek", frame=23)
        told = [await page.hear("image", lambda m: m["frame"] == 23)]
        told += [await page.hear("image") for _ in range(11)]
        # What the footage shows does not wait for what is computed from it.
        sets = [
            sorted({(m["layer"], m["of"]) for m in told if m["set"] == n}) for n in sorted({m["set"] for m in told})
        ]
        assert sets == [[("image", 6), ("parts", 6)], [("distance", 6), ("silhouette", 6)]]
        sizes = {(m["layer"], m["camera"]): size_of(m["payload"]) for m in told}
        assert {key: size for key, size in sizes.items() if key[0] == "image"} == {
            ("image", 0): (640, 480), ("image", 1): (400, 300), ("image", 3): (160, 120),
        }  # fmt: skip
        assert sizes["distance", 3] == sizes["silhouette", 3] == (640, 480)  # as they are matched
        assert sizes["parts", 1] == (400, 300)
        limits = {m["layer"]: m["limit_px"] for m in told}
        assert limits == {"image": None, "silhouette": None, "parts": None, "distance": pytest.approx(2 * 0.03 * 640)}


async def test_cached_pictures_are_sent_without_a_worker(controller, monkeypatch):
    """In playback of a loop, a worker for each would take longer than the pictures do."""
    made = []
    real = PictureSets._make
    monkeypatch.setattr(PictureSets, "_make", lambda self, key, *args: made.append(key) or real(self, key, *args))
    async with visiting(controller) as page:
        await page.hear("image", lambda m: (m["of"], m["camera"]) == (4, 3))
        for frame in (7, 0, 7):
            await page.send("seek", frame=frame)
            await page.hear("image", lambda m, frame=frame: (m["frame"], m["camera"]) == (frame, 3))
            if frame == 0:
                made.clear()
    assert made == []


@pytest.mark.slow
async def test_evidence_waits_for_the_pictures(controller):
    """Both need the processor: what the eye waits for goes first."""
    frames, made = controller.frames, []
    image, evidence = frames.image, frames.observer.evidence

    def slow(*args):
        picture = image(*args)
        made.append("image")
        return picture

    async with visiting(controller) as page:
        await page.hear("image", lambda m: m["of"] == 4)
        frames.image, frames._rest_s = slow, 0.2
        frames._evidence._compute = lambda key: made.append("evidence") or evidence(key[0])
        await page.send("seek", frame=7)
        await page.hear("state", lambda m: m["frame"] == 7 and m["cost_px"] is not None)
    assert made == ["image"] * 4 + ["evidence"]


@pytest.mark.slow
async def test_a_pose_changes_the_part_masks_alone(controller, page):
    await page.shows("image", "parts")
    await page.hear("image", lambda m: (m["layer"], m["camera"]) == ("parts", 3))  # the last one
    count = len(page.told)
    drag(controller, "left_knee", (4.0, 0.0))
    await page.hear("image", lambda m: m["camera"] == 3)
    assert {m["layer"] for m in page.told[count:] if m["type"] == "image"} == {"parts"}


@pytest.mark.slow
async def test_only_news_is_sent_to_a_page(page):
    await page.hear("image", lambda m: m["of"] == 4)
    await page.shows("image", reductions=(0, 1, 0, 0))
    overlay = await page.hear("overlay", lambda m: {h["camera"] for h in m["handles"]} == {1})
    assert overlay["paths"] == []
    count = len(page.told)
    await page.shows("image", reductions=(1, 1, 0, 0))
    image = await page.hear("image", lambda m: m["of"] == 1)
    assert image["camera"] == 0
    assert len([m for m in page.told[count:] if m["type"] == "image"]) <= 4  # the rest of the first set


async def test_a_page_without_visible_panes_gets_no_view_until_it_shows_one(page):
    await page.shows("image", "contours")
    await page.hear("image")
    await page.shows("image", "contours", reductions=(0, 0, 0, 0))
    await page.seek(3)
    await page.send("history", limit=1)
    await page.hear("history")
    assert not [m for m in page.told if m["type"] in ("image", "overlay") and m["frame"] == 3]
    await page.shows("image", "contours", reductions=(0, 2, 0, 0))
    assert (await page.hear("image", lambda m: m["frame"] == 3))["camera"] == 1
    overlay = next(m for m in page.told if m["type"] == "overlay" and m["frame"] == 3)
    assert {path["camera"] for path in overlay["paths"]} == {1}


async def test_a_view_that_is_not_understood_is_a_notice(controller, caplog):
    async with visiting(controller) as page:
        for layer, reductions in (("x-rays", (1, 1, 1, 1)), ("parts", (1, 1)), ("parts", (1, 1, 0.5, 0))):
            await page.shows("image", layer, reductions=reductions)
            assert (await page.hear("notice"))["text"] == MISUNDERSTOOD
    reasons = [record.getMessage() for record in caplog.records]
    assert "as 'layers[1]', found 'x-rays'" in reasons[0]
    assert all("0 or a reduction from 1 to 64 for each of 4 cameras" in reason for reason in reasons[1:])


def size_of(picture):
    height, width = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_UNCHANGED).shape[:2]
    return width, height


async def test_a_page_connects_again_where_a_person_gets_other_joints(controller):
    async with visiting(controller) as page:
        assert len((await page.hear("session"))["people"][0]["parts"]) == 10
        await page.hear("state")
        await page.send("body_sizes", action="body", person=0, to="gavrila38")
        with pytest.raises(AssertionError, match="CLOSE"):
            await page.hear("session")
    async with visiting(controller) as page:
        assert len((await page.hear("session"))["people"][0]["parts"]) == 16
        assert len((await page.hear("state"))["dofs"]) == 38


async def test_a_page_asks_for_epipolar_lines_until_it_asks_no_more(page):
    await page.hear("timeline")
    await page.send("epipolar", points=[[0, 320.0, 240.0]])
    found = await page.hear("epipolar")
    assert {line["camera"] for line in found["lines"]} == {1, 2, 3}
    assert found["distance"] is None
    line = found["lines"][0]
    middle = [line["camera"], (line["x0"] + line["x1"]) / 2, (line["y0"] + line["y1"]) / 2]
    await page.send("epipolar", points=[[0, 320.0, 240.0], middle])
    distance = (await page.hear("epipolar"))["distance"]
    assert (distance["camera"], distance["px"]) == (middle[0], pytest.approx(0, abs=0.02))
    await page.send("epipolar", points=[[99, 0.0, 0.0]])
    assert (await page.hear("notice"))["text"] == MISUNDERSTOOD
    await page.send("epipolar", points=[])
    assert (await page.hear("epipolar"))["lines"] == []
