import numpy as np
import pytest

from tracker.body.motion.pose_steps import PredictSettings
from tracker.estimation.tracking.confidence import LimbFeatures, PoseQuality
from tracker.estimation.tracking.person_memory import PersonMemory

CLEAR = LimbFeatures("", 0.0, 1.2, 0.06, 1.0, 0.5, 0.01)
SUSPECT = CLEAR._replace(free_spread_px=4.0)
ASTRAY = LimbFeatures("", 0.25, 6.0, 0.4, -1.0, 0.1, 0.2)


class NoColors:
    """Stands for the colours of a frame that shows none."""

    def learn(self, *_):
        return None


def seen(memory, others=CLEAR, astray=()):
    """Evidence of a pose where some limbs are astray, and of the others."""
    limbs = [(ASTRAY if x.name in astray else others)._replace(name=x.name) for x in memory.limbs]
    return PoseQuality(0.05, 4, 0.05, tuple(limbs))


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


def test_locked_limbs_are_not_due(memory):
    assert {x.name for x in memory.limbs} == {"right_forearm", "left_calf", "right_calf"}
    assert {x.name for x in memory.limbs_to_search(seen(memory, SUSPECT))} == {x.name for x in memory.limbs}
    assert memory.limbs_to_search(seen(memory)) == memory.search_candidates(seen(memory)) == []


def test_the_limb_most_likely_off_goes_first(memory):
    found = seen(memory, SUSPECT, astray=("right_calf",))
    assert memory.search_candidates(found)[0].name == "right_calf"
    assert len(memory.search_candidates(found)) == 3


def test_pauses_grow_with_each_search_in_vain(memory):
    """Up to eight frames."""
    assert np.diff(searched_at(memory, seen(memory, astray=("left_calf",)), 40)).tolist() == [2, 4, 8, 9, 9]
    found = seen(memory, astray=("left_calf",))
    memory.record_search(next(x for x in memory.limbs if x.name == "left_calf"), found, found=True)
    assert memory.limbs_to_search(seen(memory, astray=("left_calf",))) == []
    memory.update(memory.history[-1], NoColors(), "good", keyframe=False)
    assert len(memory.limbs_to_search(seen(memory, astray=("left_calf",)))) == 1


def test_a_limb_of_somebody_alone_that_is_lost_does_not_wait(memory, gavrila):
    """One that is merely suspect does, and so does one of several people."""
    alone = PersonMemory(gavrila, gavrila.neutral(), memory.active_dofs)
    lost, suspect = seen(memory, astray=("left_calf",)), seen(memory, SUSPECT)
    assert lost.missing_limbs == ("left_calf",)
    assert suspect.missing_limbs == ()
    assert searched_at(alone, lost, 6) == [0, 1, 2, 3, 4, 5]
    assert searched_at(memory, lost, 6) == [0, 2]
    assert searched_at(alone, suspect, 1) == [0]
    assert "left_calf" not in {x.name for x in alone.limbs_to_search(suspect)}


def test_a_limb_of_somebody_alone_is_searched_again_once_the_frame_contradicts_it_more(gavrila):
    """A search that failed says nothing about a limb that has left its place since."""
    memory = PersonMemory(gavrila, gavrila.neutral())
    doubtful, worse = (_with_spread(seen(memory), "left_calf", px) for px in (2.5, 6.0))
    assert doubtful.off_odds_of("left_calf") + 2.0 < worse.off_odds_of("left_calf") < 0.0
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
    limbs = tuple(x._replace(free_spread_px=spread_px) if x.name == name else x for x in quality.limbs)
    return quality._replace(limbs=limbs)


def test_predicting_two_frames_ahead_is_predicting_twice(gavrila):
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
