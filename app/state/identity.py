"""Identity of values that are expensive or impossible to compare, such as poses."""

from dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class Identity:
    """Equal to another only if both hold the same object, which stays alive so that no other can take its id."""

    value: object

    def __eq__(self, other: object) -> bool:
        """Compare by identity."""
        return isinstance(other, Identity) and self.value is other.value

    def __hash__(self) -> int:
        """Hash by identity."""
        return id(self.value)
