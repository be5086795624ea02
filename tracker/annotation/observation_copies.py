"""Copy stored observations from one session to another, so that none of two with one name is lost."""

import filecmp
import shutil
from itertools import count
from pathlib import Path

import tomli_w

from tracker.files import write_text_atomic
from tracker.formats.text_files import read_toml
from tracker.interchange.observations.stored import DESCRIPTION, FOLDER, KIND


def copy_observations(source: Path, into: Path) -> list[str]:
    """Copy all observations of a session. What is there already under its name with the same content stays.

    Args:
        source: folder of the session to copy from.
        into: folder of the session to copy to.

    Returns:
        A sentence on each set that got another name, because there is another one of its name.

    Raises:
        SessionError: the description of a set that gets another name is damaged.
        OSError: something cannot be read or written.
    """
    notes = []
    for one in sorted(p for p in (source / FOLDER).glob("*") if p.is_dir() and not p.name.startswith(".")):
        names = (one.name if k == 1 else f"{one.name}_{k}" for k in count(1))
        name = next(n for n in names if not (into / FOLDER / n).exists() or _is_same(one, into / FOLDER / n))
        target = into / FOLDER / name
        if target.exists():
            continue
        shutil.copytree(one, target)
        if name != one.name:
            _rename(target, name)
            notes.append(f"both copies have other observations '{one.name}': those of {source} are '{name}' now")
    return notes


def _rename(folder: Path, name: str) -> None:
    description = folder / DESCRIPTION
    if description.exists():
        write_text_atomic(description, tomli_w.dumps(read_toml(description, KIND) | {"name": name}))


def _is_same(one: Path, other: Path) -> bool:
    """Return whether two sets have the same content, whatever they are called."""
    files = [{p.relative_to(at) for p in at.rglob("*") if p.is_file()} for at in (one, other)]
    if files[0] != files[1]:
        return False
    described = {Path(DESCRIPTION)} if Path(DESCRIPTION) in files[0] and one.name != other.name else set()
    texts = [read_toml(at / DESCRIPTION, KIND) | {"name": ""} for at in (one, other) if described]
    alike = all(filecmp.cmp(one / path, other / path, shallow=False) for path in files[0] - described)
    return alike and all(text == texts[0] for text in texts)
