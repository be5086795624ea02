"""Identity of values that are expensive or impossible to compare, such as poses."""

from collections.abc import Sequence
from dataclasses import dataclass
from operator import is_


@dataclass(frozen=True, eq=False)
class ObjectIdentity:
    """Equal to another only if both hold the same object, which stays alive so that no other can take its id."""

    value: object

    def __eq__(self, other: object) -> bool:
        """Compare by identity."""
        return isinstance(other, ObjectIdentity) and self.value is other.value

    def __hash__(self) -> int:
        """Hash by identity."""
        return id(self.value)


def are_same(values: Sequence[object], others: Sequence[object]) -> bool:
    """Return whether two sequences hold the same objects."""
    return len(values) == len(others) and all(map(is_, values, others))
