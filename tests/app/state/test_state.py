"""The state is made of parts, each of which declares fields of its own."""

from collections import Counter
from dataclasses import fields

from app.state.state import State


def test_each_field_is_declared_once():
    declared = Counter(name for part in State.__bases__ for name in part.__annotations__)
    assert set(declared) == {f.name for f in fields(State)}
    assert set(declared.values()) == {1}
