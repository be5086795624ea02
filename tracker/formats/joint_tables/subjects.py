"""People of a file by the prefix of its names, as in `anna:LASI`, which motion capture systems write."""

from collections.abc import Sequence
from dataclasses import replace

from tracker.formats.trc import MarkerTable


def by_subject(table: MarkerTable, kept: Sequence[str] = ()) -> list[MarkerTable]:
    """Return a table for each subject, with names without prefixes; all in one if no two subjects have equal names.

    Args:
        table: the points of a file.
        kept: names that are asked for as they stand.
    """
    groups: dict[str, list[int]] = {}
    for i, name in enumerate(table.names):
        groups.setdefault(name.rpartition(":")[0], []).append(i)
    subjects = {prefix: columns for prefix, columns in groups.items() if prefix}
    if table.person or not subjects or any(name in kept for name in table.names):
        return [table]
    plain = [name.rpartition(":")[2] for name in table.names]
    largest = max(subjects, key=lambda prefix: len(subjects[prefix]))
    own = {plain[i] for i in subjects[largest]}
    people = [p for p, columns in subjects.items() if p == largest or own & {plain[i] for i in columns}]
    if len(people) == 1:
        names = [plain[i] if i in subjects[largest] else name for i, name in enumerate(table.names)]
        is_once = len(set(names)) == len(names)
        return [replace(table, names=tuple(names), person=largest) if is_once else table]
    rest = [table.names[columns[0]] for prefix, columns in groups.items() if prefix not in people]
    notes = (f"points of no person, such as {rest[0]}, are left out",) if rest else ()
    table = replace(table, notes=(*table.notes, *notes))
    parts = [(person, subjects[person]) for person in people]
    return [
        replace(table, names=tuple(plain[i] for i in own), points=table.points[:, own], person=person)
        for person, own in parts
    ]
