"""Two copies of one store, merged."""

import pytest
from annotated_copies import ACTIONS, FRAMES, act, all_edits, copied, merged, new_store, shown
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tracker.store.annotation_store import AnnotationStore

STEPS = st.lists(st.tuples(st.integers(0, ACTIONS - 1), st.sampled_from(FRAMES), st.integers(0, 9)), max_size=8)


def play(path, steps):
    store = AnnotationStore(path)
    for step in steps:
        act(store, *step)
    store.close()
    return path


@pytest.mark.slow
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(before=STEPS, mine=STEPS, theirs=STEPS, later=STEPS)
def test_merging_is_commutative_and_merging_again_changes_nothing(tmp_path_factory, before, mine, theirs, later):
    folder = tmp_path_factory.mktemp("merge")
    new_store(folder / "a").close()
    play(folder / "a", before)
    copied(folder / "a", folder / "b").close()
    play(folder / "a", mine)
    play(folder / "b", theirs)
    ab, ba = merged(folder / "a", folder / "b", folder / "ab"), merged(folder / "b", folder / "a", folder / "ba")
    assert shown(ab) == shown(ba)
    assert all_edits(ab) == all_edits(ba)
    assert shown(ab)[:2] == shown(merged(ab, folder / "b", folder / "abb"))[:2]
    for source in ("a", "b"):
        again = merged(ab, folder / source, folder / f"again_{source}")
        assert shown(again) == shown(ab)
        assert all_edits(again) == all_edits(ab)
    edits, _ = all_edits(ab)
    assert {*edits} >= {*all_edits(folder / "a")[0], *all_edits(folder / "b")[0]}
    play(folder / "b", later)  # a copy that goes on
    once = merged(ab, folder / "b", folder / "once")
    assert shown(once) == shown(merged(folder / "b", ab, folder / "other"))
    assert shown(merged(once, folder / "b", folder / "twice")) == shown(once)
