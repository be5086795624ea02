"""A page that joins a session: the role that its link gives, and the name of its user."""

from typing import Literal, NamedTuple, TypeAlias

Role: TypeAlias = Literal["annotate", "review", "look"]
"""Pages with the role `review` may mark poses as reviewed; those with `look` change nothing that is stored."""
MAX_NAME = 40
"""Characters of a name: it has to fit a chip."""


class Visitor(NamedTuple):
    """The user of a page."""

    role: Role = "annotate"
    name: str = ""
    """As given on joining; empty for the annotator of the program."""
