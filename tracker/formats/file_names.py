"""Names that foreign formats and file systems accept."""

import re
from collections.abc import Sequence


def identifier(name: str) -> str:
    """Replace all but letters, digits, `_`, `-` and `.` by `_`."""
    return re.sub(r"[^\w.-]", "_", name)


def identifiers(names: Sequence[str]) -> list[str]:
    """Return an identifier for each name, each once: what coincides gets a number."""
    out: list[str] = []
    for name in names:
        plain, n = identifier(name), 1
        unique = plain
        while unique in out:
            n += 1
            unique = f"{plain}_{n}"
        out.append(unique)
    return out
