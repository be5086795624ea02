"""What a session stores, summed up from the cells of the timeline."""

from app.advice.stored_work import PersonWork, Unsure
from tracker.body.limbs import limb_display_name, limbs
from tracker.formats.model_toml import load_model

MODEL = load_model("gavrila34")
LIMBS = [limb_display_name(limb.name) for limb in limbs(MODEL)]


def cell(status="good", source="tracked", lost=(), reviewed=False, remark=""):
    return {"status": status, "source": source, "limbs_lost": lost, "reviewed": reviewed, "remark": remark}


def lost(limb, probability):
    return tuple(probability if i == limb else 0.01 for i in range(len(LIMBS)))


def work(cells):
    return PersonWork.of("Ann", MODEL, cells, 10.0)


def test_poses_are_counted_by_their_origin():
    found = work({0: cell(source="manual", status=""), 4: cell(), 2: cell(), 6: None})
    assert (found.first, found.last, found.step, found.n_poses, found.n_tracked) == (0, 4, 2, 3, 2)
    assert work({}).first is None


def test_doubts_of_a_limb_within_a_second_are_one():
    cells = {k: cell("doubtful", lost=lost(1, 0.3)) for k in (5, 6, 12)} | {40: cell("doubtful", lost=lost(1, 0.4))}
    cells[9] = cell("lost", lost=lost(0, 0.9))
    found = work(cells)
    assert found.n_unsure == 5
    assert found.unsure == (
        Unsure(9, 9, 9, "lost", 0.9, LIMBS[0]),
        Unsure(40, 40, 40, "doubtful", 0.4, LIMBS[1]),
        Unsure(5, 12, 5, "doubtful", 0.3, LIMBS[1]),
    )


def test_the_worst_frame_of_a_stretch_is_the_one_to_look_at():
    found = work({k: cell("doubtful", lost=lost(1, p)) for k, p in ((5, 0.2), (6, 0.5), (7, 0.3))})
    assert found.unsure == (Unsure(5, 7, 6, "doubtful", 0.5, LIMBS[1]),)


def test_reviewed_poses_are_not_in_doubt():
    assert work({3: cell("lost", lost=lost(0, 0.9), reviewed=True)}).n_unsure == 0


def test_poses_without_limbs_are_gathered_by_their_remark():
    found = work({1: cell("lost", remark="cut off"), 2: cell("lost", remark="cut off")})
    assert found.unsure == (Unsure(1, 2, 1, "lost", 0.0, ""),)
