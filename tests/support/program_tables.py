"""The tables of programs in the documents, as the tables of the code have them."""

from tracker.formats.calibrations import layouts as calibrations
from tracker.formats.joint_tables import layouts as joints
from tracker.interchange.observations import readers


def calibration_table():
    """Table of `docs/log/recordings.md`."""
    rows = ["| layout | recognized by | poses | unit |", "|---|---|---|---|"]
    for layout in calibrations.layouts():
        poses = f"`{layout.poses}`" if "=" in layout.poses else layout.poses
        rows.append(f"| {layout.name} | {layout.recognized_by} | {poses} | {layout.unit or 'given, else m'} |")
    return "\n".join(rows) + "\n"


def observation_table():
    """Table of formats of `docs/log/observations.md`."""
    unread = [row for row in readers.UNREAD if row not in joints.NOT_READ]
    cells = [f"{row.recognized_by}; not read: export {row.instead}" for row in unread]
    return _table([*readers.FORMATS.values(), *unread], [row.recognized_by for row in readers.FORMATS.values()] + cells)


def joint_table():
    """Table of joints in space of `docs/log/observations.md`."""
    cells = [f"not read: export {row.instead}" for row in joints.NOT_READ]
    return _table([*joints.LAYOUTS, *joints.NOT_READ], [row.recognized_by for row in joints.LAYOUTS] + cells)


def _table(layouts, cells):
    rows = [f"| {row.program} | {row.files} | {cell} |" for row, cell in zip(layouts, cells, strict=True)]
    return "\n".join(["| program | files | recognized by |", "|---|---|---|", *rows]) + "\n"
