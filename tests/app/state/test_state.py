"""The fields by which a state is changed are those of the state."""

from typing import get_type_hints

from app.state.state import Costs, ShownFrame, State, StateChanges


def test_changes_have_the_fields_and_types_of_the_state():
    assert get_type_hints(StateChanges) == get_type_hints(State)


def test_every_change_is_optional():
    assert not StateChanges.__required_keys__


def test_costs_and_frames_are_parts_of_the_state():
    fields = get_type_hints(State).items()
    assert get_type_hints(Costs).items() <= fields
    assert get_type_hints(ShownFrame).items() <= fields
