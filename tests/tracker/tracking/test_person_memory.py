import numpy as np
import pytest

from tracker.motion.prediction import PredictSettings
from tracker.tracking.confidence import LimbFeatures, PoseQuality
from tracker.tracking.person_memory import PersonMemory

CLEAR = (1.0, 0.0, 1.2, 0.05, 0.6, 0.5, 0.0, 1.2, 0.06, 1.0, 0.5, 0.01)
ASTRAY = (-2.0, 3.0, 4.0, 0.3, 0.2, 0.1, 0.25, 6.0, 0.4, -1.0, 0.1, 0.2)


class NoColors:
    """Stands for the colours of a frame that shows none."""

    def learn(self, *_):
        return None


def seen(memory, unexplained=0.0, astray=()):
    """What the evidence says where some limbs are astray and the others clear."""
    limbs = [LimbFeatures(x.name, *(ASTRAY if x.name in astray else CLEAR)) for x in memory.limbs]
    return PoseQuality(0.05, 4, unexplained, 0.05, tuple(limbs))


def searched_at(memory, found, n_frames):
    """The frames in which the first limb to search is searched, and never found."""
    out = []
    for frame in range(n_frames):
        for limb in memory.limbs_to_search(found)[:1]:
            memory.record_search(limb, found, found=False)
            out.append(frame)
        memory.update(memory.history[-1], NoColors(), "doubtful", keyframe=False)
    return out


@pytest.fixture
def memory(gavrila):
    free = ~np.array([name.startswith(("left_shoulder", "left_elbow")) for name in gavrila.dof_names])
    return PersonMemory(gavrila, gavrila.neutral(), free, alone=False)


def test_what_is_locked_is_not_due(memory):
    assert {x.name for x in memory.limbs} == {"right_forearm", "left_calf", "right_calf"}
    assert {x.name for x in memory.limbs_to_search(seen(memory, unexplained=0.2))} == {x.name for x in memory.limbs}
    assert memory.limbs_to_search(seen(memory)) == memory.search_candidates(seen(memory)) == []


def test_limbs_that_seem_lost_go_before_those_that_do_not(memory):
    """What no part explains makes all suspect, but it is theirs first; and theirs alone while they wait."""
    found = seen(memory, unexplained=0.2, astray=("left_calf",))
    assert memory.search_candidates(found)[0].name == "left_calf"
    assert len(memory.search_candidates(found)) == 3
    (limb,) = memory.limbs_to_search(found)
    assert limb.name == "left_calf"
    memory.record_search(limb, found, found=False)
    assert memory.limbs_to_search(found) == []


def test_pauses_grow_with_each_search_in_vain(memory):
    """Of a limb that seems lost up to eight frames; of one that does not they go on growing."""
    assert np.diff(searched_at(memory, seen(memory, astray=("left_calf",)), 40)).tolist() == [2, 4, 8, 9, 9]
    found = seen(memory, astray=("left_calf",))
    memory.record_search(next(x for x in memory.limbs if x.name == "left_calf"), found, found=True)
    assert memory.limbs_to_search(seen(memory, astray=("left_calf",))) == []
    memory.update(memory.history[-1], NoColors(), "good", keyframe=False)
    assert len(memory.limbs_to_search(seen(memory, astray=("left_calf",)))) == 1


def test_a_limb_of_somebody_alone_that_is_lost_does_not_wait(memory, gavrila):
    """One that is merely suspect does, and so does one of several people."""
    alone = PersonMemory(gavrila, gavrila.neutral(), memory.active_dofs)
    lost, suspect = seen(memory, astray=("left_calf",)), seen(memory, unexplained=0.2)
    assert lost.missing_limbs == ("left_calf",)
    assert suspect.missing_limbs == ()
    assert searched_at(alone, lost, 6) == [0, 1, 2, 3, 4, 5]
    assert searched_at(memory, lost, 6) == [0, 2]
    assert searched_at(alone, suspect, 1) == [0]
    assert "left_calf" not in {x.name for x in alone.limbs_to_search(suspect)}


def test_a_limb_that_makes_the_pose_lost_does_not_wait(gavrila):
    """Even where its search odds alone would let it wait."""
    memory = PersonMemory(gavrila, gavrila.neutral())
    found = _with_spread(seen(memory), "left_calf", 5.0)
    limbs = tuple(x._replace(free_spread_px=40.0) if x.name == "left_calf" else x for x in found.limbs)
    lost = found._replace(limbs=limbs)
    assert (lost.lost_limbs, lost.missing_limbs, found.lost_limbs) == (("left_calf",), (), ())
    assert searched_at(memory, lost, 3) == [0, 1, 2]
    assert searched_at(PersonMemory(gavrila, gavrila.neutral()), found, 3) == [0, 2]
    assert searched_at(PersonMemory(gavrila, gavrila.neutral(), alone=False), lost, 3) == [0, 2]


def test_a_limb_of_somebody_alone_is_searched_again_once_the_frame_contradicts_it_more(gavrila):
    """A search that failed says nothing about a limb that has left its place since."""
    memory = PersonMemory(gavrila, gavrila.neutral())
    doubtful, worse = (_with_spread(seen(memory), "left_calf", px) for px in (5.0, 12.0))
    assert doubtful.search_odds_of("left_calf") + 2.0 < worse.search_odds_of("left_calf") < 0.0
    (limb,) = memory.limbs_to_search(doubtful)
    memory.record_search(limb, doubtful, found=False)
    assert memory.limbs_to_search(doubtful) == []
    assert memory.limbs_to_search(worse) == [limb]
    memory.record_search(limb, worse, found=False)
    assert memory.limbs_to_search(worse) == []
    others = PersonMemory(gavrila, gavrila.neutral(), alone=False)
    others.record_search(limb, doubtful, found=False)
    assert others.limbs_to_search(worse) == []


def _with_spread(quality, name, spread_px):
    """The same with a limb whose end is uncertain."""
    limbs = tuple(x._replace(spread_px=spread_px, color=0.6) if x.name == name else x for x in quality.limbs)
    return quality._replace(limbs=limbs)


def test_limbs_that_nothing_speaks_against_wait_longer(gavrila):
    memory = PersonMemory(gavrila, gavrila.neutral(), alone=False)
    everything = seen(memory, unexplained=0.2)
    frames = []
    for _ in range(110):
        due = memory.limbs_to_search(everything)
        frames.append(len(due))
        for limb in due:
            memory.record_search(limb, everything, found=False)
        memory.update(memory.history[-1], NoColors(), "doubtful", keyframe=False)
    assert np.flatnonzero(frames).tolist() == [0, 32, 64, 96]
    assert set(frames) == {0, 4}
    # Once it seems lost itself it is due at once.
    (limb,) = memory.limbs_to_search(seen(memory, astray=("right_calf",)))
    assert limb.name == "right_calf"


def test_what_is_expected_two_frames_on_is_what_would_be_if_the_next_came_as_expected(gavrila):
    memory, settings = PersonMemory(gavrila, gavrila.neutral()), PredictSettings()
    step = np.zeros(gavrila.n_dofs)
    step[:3] = 0.02
    moved = gavrila.retract(gavrila.neutral(), step)
    memory.update(moved, NoColors(), "good", keyframe=False)
    twice = memory.predict_two_ahead(settings)
    memory.update(memory.predict(settings), NoColors(), "good", keyframe=False)
    np.testing.assert_array_equal(twice, memory.predict(settings))
    memory.history[-1] = gavrila.neutral()  # it came otherwise
    np.testing.assert_array_equal(twice, memory.predict_before_last(settings))
    np.testing.assert_allclose(gavrila.difference(twice, moved)[:3], 0.04, atol=1e-9)
