"""`track --init auto`: the stages, their sentences, and how an interrupted chain goes on."""

import re
from contextlib import closing

import numpy as np
import pytest

from app.cli.target import load_target
from app.cli.track_found import track_found
from tracker.errors import TrackerError
from tracker.initialization.first_pose import FirstPose, FirstPoses
from tracker.initialization.generators.start_generators import StartCandidate
from tracker.initialization.start_fit import FittedStart
from tracker.pipeline import find_people as finding
from tracker.pipeline.find_people import FoundPeople
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import PoseChange, PoseRecord

FRAME = 3


class Said(list):
    """Stands for a reporter; keeps what is said."""

    say = list.append

    def share(self, what):
        from contextlib import nullcontext

        return nullcontext(lambda share: None)


@pytest.fixture
def found(monkeypatch):
    """Stands for the search; counts how often it is done."""
    calls = []

    def find(session, observer, people, frames, settings, report):
        calls.append(people)
        model = session.people[0].model
        candidate = StartCandidate("voxels", model, model.neutral(), np.array([1.0, 0.0, 0.0]), 2.0)
        first = FirstPose(FRAME, candidate, FittedStart(model.neutral(), "good", 1.5), True, ("left arm unresolved",))
        return FoundPeople(FirstPoses(FRAME, {0: first}), {0: model}, {0: model.neutral()}, {})

    monkeypatch.setattr(finding, "find_people", find)
    return calls


def tracker(stops=()):
    """A tracker that is interrupted in some of its calls, and the frames that it was asked for."""
    asked = []

    def track(at, frames):
        asked.append(list(frames))
        stopped_at = frames[-1] if len(asked) - 1 in stops else None
        return {"stopped_at": stopped_at, "frames": len(frames)}

    return track, asked


@pytest.fixture
def target(session):
    for path in session.glob("annotations.sqlite*"):
        path.unlink()
    return lambda: load_target(session, None, several=True)


def test_it_tracks_back_to_the_first_frame_and_then_over_all(target, found):
    (track, asked), said = tracker(), Said()
    result = track_found(target(), range(6), False, said, track)
    assert asked == [[3, 2, 1, 0], [0, 1, 2, 3, 4, 5]]
    assert (result["first_frame"], result["frames"]) == (FRAME, 6)
    assert re.search(r"person: started on frame 3 by voxels.* good, cost 1.50 px", said[0])
    assert said[1:] == [
        "person: left arm unresolved", "tracking backward from frame 3 to 0", "tracking forward from frame 0 to 5",
    ]  # fmt: skip


@pytest.mark.parametrize(("stops", "left"), [((0,), 2), ((1,), 1)])
def test_an_interrupted_chain_goes_on_where_it_was(target, found, stops, left):
    track, asked = tracker(stops)
    assert track_found(target(), range(6), False, Said(), track)["stopped_at"] is not None
    before, said = len(asked), Said()
    track_found(target(), range(6), False, said, track)
    assert len(asked) - before == left
    assert asked[-1] == [0, 1, 2, 3, 4, 5]
    assert said[0] == "going on from frame 3, where all people were found"
    assert len(found) == 1
    said = Said()
    track_found(target(), range(6), False, said, tracker()[0])
    assert said[0] == "all people have a pose on frame 3: tracking starts there"


def test_the_first_frame_needs_no_way_back(target, found):
    track, asked = tracker()
    track_found(target(), range(FRAME, 6), False, Said(), track)
    assert asked == [[3, 4, 5]]


def test_people_placed_on_different_frames_alone_are_refused(target, found):
    at = target()
    with closing(AnnotationStore(at.session.annotations_path)) as store:
        values = at.session.people[0].model.neutral()
        record = PoseRecord(values, ("manual",) * len(values), store.add_model_revision("person", "x"))
        store.commit("put", [PoseChange("person", 9, record)])
    with pytest.raises(TrackerError, match="a frame on which all people have a pose"):
        track_found(at, range(6), False, Said(), tracker()[0])
    assert found == []
