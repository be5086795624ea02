"""The role of a page, which its link gives."""

from typing import Literal, TypeAlias

Role: TypeAlias = Literal["annotate", "review", "look"]
"""Pages with the role `review` may mark poses as reviewed; those with `look` change nothing that is stored."""
