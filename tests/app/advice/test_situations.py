"""The table of situations: each row, in order of urgency."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from app.advice.situations import advise
from app.advice.stored_work import PersonWork, StoredWork, Unsure
from app.state.calibration import CalibrationState
from app.state.comparison import PoseComparison
from app.state.observations import ObservationsState, ObservedSet
from app.state.people import AcquisitionState, DepthNote, ShownPose, SizeDraft
from app.state.progress import FindState, FootageState, RangeState, TrackState
from app.state.search import SearchState
from app.state.state import State
from tracker.compute.kernel_cache import STAGES
from tracker.estimation.initialization.silhouette_check import SilhouetteCheck
from tracker.estimation.posing.limb_moves import LimbMove
from tracker.estimation.posing.placed_depth import UndeterminedDepth

POSE = np.zeros(3)
CAMERAS = ("FRONT", "RIGHT", "BACK")
NOBODY = StoredWork((PersonWork("Ann"),), 90, cameras=CAMERAS)
PLACED = StoredWork((PersonWork("Ann", 0, 0, n_poses=1),), 90, cameras=CAMERAS)
TRACKED = StoredWork((PersonWork("Ann", 0, 89, n_tracked=89, n_poses=90, has_usual_sizes=False),), 90, cameras=CAMERAS)
LEG = Unsure(84, 99, 90, "doubtful", 0.4, "left leg")
WORN = replace(TRACKED, people=(replace(TRACKED.people[0], unsure=(LEG,), n_unsure=1),))


def state(source=None, **changes):
    return State(frame=0, people=(ShownPose(POSE, source),), revisions=(1,), present=(1,), **changes)


def compared(work="fit", **changes):
    return PoseComparison(
        1, 0, work, (ShownPose(POSE, "manual"),), (POSE,), (1,), 5.0, (), 2.0, (), **changes
    )  # fmt: skip


def limb_move(name, distance_m):
    return 0, LimbMove(SimpleNamespace(name=name), distance_m)


def filled(*shares):
    return SilhouetteCheck(CAMERAS[: len(shares)], np.array(shares))


CHECK = SimpleNamespace(named=("RIGHT",), contradictions=["RIGHT is turned by 0.8 degrees"])
OFF = "Footage of RIGHT ends at frame 12"
SETS = (ObservedSet("network", frames=90),)
DRAFT = SizeDraft(0, None, {3: POSE})
DEPTH = DepthNote(0, 0, POSE, UndeterminedDepth(("left_wrist", "left_knee"), 1))
MOVES = (limb_move("left_forearm", 0.21), limb_move("right_shin", 0.12))

ROWS = [
    ("unsaved", state(save_error="the disk is full"), TRACKED, "the disk is full", ["retry"]),
    ("damaged", state(footage=FootageState(error=OFF)), TRACKED, OFF, []),
    ("tracking", state(track=TrackState(True, 0, 89, 3, 4, 90)), TRACKED, "Tracking", ["stop"]),
    ("tracking", state(track=TrackState(True, 0, 8, 8, 4, 9, stage="back")), TRACKED, "Tracking backward", ["stop"]),
    ("tracking", state(track=TrackState(True, 0, 8, 8, 4, 9, stage="solve")), TRACKED, "Estimating all", ["stop"]),
    ("paused", state(track=TrackState(False, 0, 89, 3, 4, 90)), TRACKED, "paused at frame 3", ["resume", "stop"]),
    ("find", state(finding=FindState(True, "first poses", 0.3)), NOBODY, "Finding people: first poses", ["stop"]),
    (
        "find", state(finding=FindState(True, trying="trying frame 4 of 12, 3 people's figures seen", takable=30)),
        NOBODY, "Trying frame 4 of 12, 3 people's figures seen", ["take_found", "stop"],
    ),
    ("sizes", state(acquisition=AcquisitionState(True, "fitting", 0.4)), TRACKED, "sizes of Ann: fitting", ["stop"]),
    ("calibration", state(calibration=CalibrationState(True, "judging")), TRACKED, "Checking the cameras", ["stop"]),
    ("observations", state(observations=ObservationsState(True, "judging")), TRACKED, "observations", ["stop"]),
    ("range", state(ranges=RangeState(True, "interpolating", 5, 12000)), TRACKED, "Interpolating", ["stop"]),
    ("searching", state(search=SearchState(True, "search", "torso")), PLACED, "Searching: torso", ["stop"]),
    (
        "search_paused", state(search=SearchState(False, "search", "arms")), PLACED, "The search is paused: arms",
        ["search", "stop"],
    ),
    ("compiling", state(compiled=frozenset(STAGES[:-1])), NOBODY, "Compiling", []),
    ("indexing", state(footage=FootageState(listed=0.3)), NOBODY, "Indexing", []),
    (
        "not_found", state(finding=FindState(failed=True, message="Expected figures; look.", tried=30, camera=1)),
        NOBODY, "People were not found: expected figures.", ["place", "show_silhouettes", "show_section"],
    ),
    ("failed", state(acquisition=AcquisitionState(failed=True, message="no view")), TRACKED, "No ", ["show_section"]),
    ("search_failed", state(search=SearchState(message="no frame", failed=True)), PLACED, "No frame.", []),
    ("run_failed", state(track=TrackState(failed=True, notice="stopped")), TRACKED, "Stopped.", []),
    ("no_depth", state("manual", depth_note=DEPTH), PLACED, "left wrist and 1 more are. Drag it in R", ["show_view"]),
    ("nobody", state(observations=ObservationsState(sets=SETS)), NOBODY, "key points", ["by_key_points", "place"]),
    ("nobody", state(), NOBODY, "Nobody is placed yet. Find people", ["find", "place"]),
    ("nobody", state(), replace(NOBODY, has_outlines=False), "Let a network find", ["detect", "place"]),
    ("elsewhere", state(), replace(PLACED, people=(PersonWork("Ann", 7, 7, n_poses=1),)), "frame 7, not", ["go_to"]),
    (
        "contradicted", state("fitted", comparison=compared(warning="The fit raised the cost")),
        PLACED, "The fit raised the cost.", ["show_before"],
    ),
    (
        "unfilled", state("fitted", comparison=compared(filled=filled(0.7, 0.3, 0.4))),
        PLACED, "share only 30% of their area in RIGHT", ["show_view", "fit", "show_before"],
    ),
    (
        "fitted", state("fitted", comparison=compared(filled=filled(0.8, 0.7, 0.8), moved=MOVES)), PLACED,
        "fills the silhouettes of 3 views. It moved 2 limbs that you had not placed: left arm 21 cm, right shin 12 cm",
        ["track", "show_before", "take_back", "take_all_back"],
    ),
    ("fitted", state("fitted", comparison=compared()), PLACED, "look at each view. Track", ["track", "show_before"]),
    ("moved", state("fitted", comparison=compared(moved=MOVES[:1])), TRACKED, "arm 21", ["show_before", "take_back"]),
    ("fitted", state("fitted"), PLACED, "The pose here is fitted.", ["track", "fit"]),
    ("searched", state("searched", comparison=compared("search")), PLACED, "The search is done.", ["fit", "track"]),
    ("placed", state("manual"), PLACED, "Search for the pose around", ["search", "fit"]),
    ("drafted", state("tracked", draft=DRAFT), TRACKED, "sizes of Ann are acquired", ["apply_sizes", "show_section"]),
    (
        "outdated", state("tracked", calibration=CalibrationState(outdated={0: (1, 2)})), TRACKED,
        "2 poses are of an earlier calibration", ["track_again", "show_section"],
    ),
    ("resized", replace(state("tracked"), present=(2,)), TRACKED, "Ann is shown with", ["track", "show_section"]),
    (
        "camera_off", state("tracked", calibration=CalibrationState(check=CHECK)), TRACKED, "RIGHT is turned",
        ["apply_correction", "show_section"],
    ),
    ("camera_doubt", state("tracked", track=TrackState(notice="RIGHT is off.")), TRACKED, "RIGHT", ["check_cameras"]),
    (
        "untracked", state("tracked"), replace(TRACKED, people=(replace(TRACKED.people[0], last=40),)),
        "Frames 41 to 89 have no pose yet.", ["track"],
    ),
    (
        "usual_sizes", state("tracked"), replace(TRACKED, people=(replace(TRACKED.people[0], has_usual_sizes=True),)),
        "Ann is tracked with usual proportions", ["acquire"],
    ),
    ("unsure", state("tracked"), WORN, "89 of 90 frames are good. Frames 84 to 99: left leg unsure.", ["show_doubt"]),
    ("unsure", replace(state("tracked"), frame=90), WORN, "left leg unsure", ["accept", "show_doubt"]),
    ("done", state("tracked"), TRACKED, "All 90 poses are good or looked at.", ["export"]),
]  # fmt: skip
ORDER = list(dict.fromkeys(name for name, *_ in ROWS))


@pytest.mark.parametrize(("name", "now", "stored", "text", "deeds"), ROWS, ids=[name for name, *_ in ROWS])
def test_each_situation_has_its_sentence_and_its_buttons(name, now, stored, text, deeds):
    first = advise(now, stored)[0]
    assert (first.situation, [action.deed for action in first.actions]) == (name, deeds)
    assert text in first.text
    assert not first.text[0].islower()


def test_the_more_urgent_comes_first():
    """All that can hold at once, in the order of the table."""
    busy = state(
        "tracked", save_error="full", footage=FootageState(error=OFF, listed=0.2), track=TrackState(True, 0, 89),
        acquisition=AcquisitionState(failed=True, message="no view"), draft=DRAFT,
        calibration=CalibrationState(check=CHECK, outdated={0: (1,)}),
    )  # fmt: skip
    found = [a.situation for a in advise(busy, WORN)]
    assert found == sorted(found, key=ORDER.index)
    assert (found[0], found[-1]) == ("unsaved", "unsure")


def test_work_says_how_much_is_done():
    run = TrackState(True, 0, 89, 3, 4, 90, per_second=2.5, doubtful=1, lost=2)
    search = SearchState(True, "search", "arms", evaluations=1200, best_px=2.3)
    for now, done in (
        (state(track=run), "4 of 90 frames, 2.5 a second, 1 doubtful, 2 lost"),
        (state(track=replace(run, stage="back")), "you can go on"),
        (state(track=TrackState(True, 0, 89, total=90), compiled=frozenset()), "waiting for compilation"),
        (state(search=search), "1,200 poses scored, best 2.30 px"),
        (state(ranges=RangeState(True, "interpolating", 5, 12000)), "5 of 12,000"),
        (state(acquisition=AcquisitionState(True, "fitting", 0.4)), "40%"),
    ):
        assert advise(now, PLACED)[0].done == done


def test_time_is_left_only_where_the_share_grows_evenly():
    """The estimate ends when no pose moves, which nobody knows before."""
    runs = [state(track=TrackState(True, 0, 8, 8, 4, 9, stage=stage)) for stage in ("tracking", "back", "solve")]
    assert [advise(now, TRACKED)[0].is_timed for now in runs] == [True, True, False]
    sizes = FindState(running=True, steps=("find", "sizes"), step="sizes", stage="acquiring sizes", share=0.4)
    acquired = AcquisitionState(True, "fitting", 0.4)
    for now in (state(finding=sizes), state(acquisition=acquired)):
        assert not advise(now, PLACED)[0].is_timed


def test_nothing_is_said_of_what_is_over():
    """A dismissed doubt leaves nothing but the next step; a failure is over once everybody is placed."""
    late = state("tracked", finding=FindState(failed=True, message="Expected figures."))
    assert [a.situation for a in advise(late, TRACKED)] == ["done"]
    assert [a.situation for a in advise(state("tracked"), WORN)] == ["unsure"]


def test_two_people_are_named():
    both = replace(WORN, people=(WORN.people[0], replace(TRACKED.people[0], name="Ben")))
    two = replace(state("tracked"), people=(ShownPose(POSE, "tracked"),) * 2, revisions=(1, 1), present=(1, 1))
    assert advise(two, both)[0].text == "179 of 180 poses are good. Frames 84 to 99: left leg of Ann unsure."
    one = replace(both, people=(both.people[0], PersonWork("Ben")))
    assert advise(two, one)[0].text.startswith("Ben is not placed yet")


def test_a_stride_leaves_no_untracked_end():
    strided = replace(TRACKED, people=(replace(TRACKED.people[0], last=88, step=2),))
    assert advise(state("tracked"), strided)[0].situation == "done"
