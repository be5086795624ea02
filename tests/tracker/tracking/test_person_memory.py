import numpy as np
import pytest

from tracker.motion.prediction import PredictSettings
from tracker.tracking.confidence import LimbFigures, Quality
from tracker.tracking.person_memory import Memory

CLEAR, ASTRAY = (1.0, 0.0, 1.2, 0.05, 0.6, 0.5), (-2.0, 3.0, 4.0, 0.3, 0.2, 0.1)


class NoColors:
    """Stands for the colours of a frame that shows none."""

    def learn(self, *_):
        return None


def seen(memory, unexplained=0.0, astray=()):
    """What the evidence says where some limbs are astray and the others clear."""
    limbs = [LimbFigures(x.name, *(ASTRAY if x.name in astray else CLEAR)) for x in memory.limbs]
    return Quality(0.05, 4, unexplained, tuple(limbs))


def searched_at(memory, found, n_frames):
    """The frames in which the first limb that is due is searched, in vain each time."""
    out = []
    for frame in range(n_frames):
        for limb in memory.due(found)[:1]:
            memory.searched(limb, found, found=False)
            out.append(frame)
        memory.update(memory.past[-1], NoColors(), "doubtful", given=False)
    return out


@pytest.fixture
def memory(gavrila):
    free = ~np.array([name.startswith(("left_shoulder", "left_elbow")) for name in gavrila.dof_names])
    return Memory(gavrila, gavrila.neutral(), free, alone=False)


def test_what_is_locked_is_not_due(memory):
    assert {x.name for x in memory.limbs} == {"right_forearm", "left_calf", "right_calf"}
    assert {x.name for x in memory.due(seen(memory, unexplained=0.2))} == {x.name for x in memory.limbs}
    assert memory.due(seen(memory)) == memory.suspects(seen(memory)) == []


def test_limbs_that_seem_lost_go_before_those_that_do_not(memory):
    """What no part explains makes all suspect, but it is theirs first; and theirs alone while they wait."""
    found = seen(memory, unexplained=0.2, astray=("left_calf",))
    assert memory.suspects(found)[0].name == "left_calf"
    assert len(memory.suspects(found)) == 3
    (limb,) = memory.due(found)
    assert limb.name == "left_calf"
    memory.searched(limb, found, found=False)
    assert memory.due(found) == []


def test_pauses_grow_with_each_search_in_vain(memory):
    """Of a limb that seems lost up to eight frames; of one that does not they go on growing."""
    assert np.diff(searched_at(memory, seen(memory, astray=("left_calf",)), 40)).tolist() == [2, 4, 8, 9, 9]
    found = seen(memory, astray=("left_calf",))
    memory.searched(next(x for x in memory.limbs if x.name == "left_calf"), found, found=True)
    assert memory.due(seen(memory, astray=("left_calf",))) == []
    memory.update(memory.past[-1], NoColors(), "good", given=False)
    assert len(memory.due(seen(memory, astray=("left_calf",)))) == 1


def test_a_limb_of_somebody_alone_that_is_lost_does_not_wait(memory, gavrila):
    """One that is merely suspect does, and so does one of several people."""
    alone = Memory(gavrila, gavrila.neutral(), memory.free)
    lost, suspect = seen(memory, astray=("left_calf",)), seen(memory, unexplained=0.2)
    assert lost.lost == ("left_calf",)
    assert suspect.lost == ()
    assert searched_at(alone, lost, 6) == [0, 1, 2, 3, 4, 5]
    assert searched_at(memory, lost, 6) == [0, 2]
    assert searched_at(alone, suspect, 1) == [0]
    assert "left_calf" not in {x.name for x in alone.due(suspect)}


def test_limbs_that_nothing_speaks_against_wait_longer(gavrila):
    memory = Memory(gavrila, gavrila.neutral(), alone=False)
    everything = seen(memory, unexplained=0.2)
    frames = []
    for _ in range(110):
        due = memory.due(everything)
        frames.append(len(due))
        for limb in due:
            memory.searched(limb, everything, found=False)
        memory.update(memory.past[-1], NoColors(), "doubtful", given=False)
    assert np.flatnonzero(frames).tolist() == [0, 32, 96]
    assert set(frames) == {0, 4}
    # Once it seems lost itself it is due at once.
    (limb,) = memory.due(seen(memory, astray=("right_calf",)))
    assert limb.name == "right_calf"


def test_what_is_expected_two_frames_on_is_what_would_be_if_the_next_came_as_expected(gavrila):
    memory, settings = Memory(gavrila, gavrila.neutral()), PredictSettings()
    step = np.zeros(gavrila.n_dofs)
    step[:3] = 0.02
    moved = gavrila.retract(gavrila.neutral(), step)
    memory.update(moved, NoColors(), "good", given=False)
    twice = memory.expected_ahead(settings)
    memory.update(memory.expected(settings), NoColors(), "good", given=False)
    np.testing.assert_array_equal(twice, memory.expected(settings))
    memory.past[-1] = gavrila.neutral()  # it came otherwise
    np.testing.assert_array_equal(twice, memory.was_expected(settings))
    np.testing.assert_allclose(gavrila.difference(twice, moved)[:3], 0.04, atol=1e-9)
