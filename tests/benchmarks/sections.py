"""Documents of which scripts write a section each, and leave the others alone."""

import re
from pathlib import Path


def put_section(path: Path, section: str) -> None:
    """Write a section, text under its first line `# ...`, in place of that of the same heading, or at the end."""
    heading = section.splitlines()[0]
    before = re.split(r"^(?=# )", path.read_text("utf-8"), flags=re.MULTILINE) if path.exists() else []
    found = [s for s in before if s.strip()]
    own = [i for i, s in enumerate(found) if s.splitlines()[0] == heading]
    for i in own or [len(found)]:
        found[i : i + 1] = [section]
    path.write_text("\n".join(s.strip("\n") + "\n" for s in found), "utf-8")
