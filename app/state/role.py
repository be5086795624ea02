"""The role of a page, which its link gives."""

from typing import Literal, TypeAlias

Role: TypeAlias = Literal["host", "annotate", "review", "look"]
"""The host opened the session and may do everything. Pages with the role `annotate` change poses; those with `review`
mark poses and decide on tasks; those with `look` change nothing that is stored."""
