"""Replace points in a table of joints with a row for each frame; all other bytes stay."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from tracker.errors import FormatError
from tracker.formats.delimited import read_delimited
from tracker.formats.joint_tables.columns import named_columns
from tracker.formats.joint_tables.layouts import WIDE, find_layout
from tracker.formats.joint_tables.table_reading import read_table
from tracker.formats.observation_layout import Sample
from tracker.formats.text_patch import TextPatch
from tracker.geometry.arrays import Array
from tracker.geometry.lengths import METRES_BY_WORD


def patch_table(path: Path, unit_m: float | None, changes: Mapping[int, Array]) -> bytes:
    """Return a file with some points replaced, in its unit; all other bytes stay.

    Args:
        path: the file, which has been read before.
        unit_m: metres per unit, if the file states none.
        changes: positions, (n_points, 3), metres, by row, from 0; points of NaN stay.

    Raises:
        FormatError: it is of another layout, or has decimal commas.
    """
    layout, table, patch = find_layout(Sample(path)), read_delimited(path), TextPatch(path.read_bytes())
    columns = named_columns(table) if layout is WIDE else None
    if columns is None or columns.person is not None or (table.separator != "," and "," in patch.text):
        expected = "a table with a row for each frame of one person and points in decimal numbers, the one layout"
        found = layout.program if layout else "another"
        advice = "export the poses as TRC or CSV"
        raise FormatError.mismatch(path, f"{expected} into which points are written back", found, advice)
    (found,) = read_table(named_columns, path, unit_m, 1.0)
    scale = METRES_BY_WORD.get(columns.unit, unit_m)
    assert scale is not None
    at = [i for triple in columns.points.values() for i in triple]
    new = {
        row: {i: float(x / scale) for i, x in zip(at, points.ravel(), strict=True) if not np.isnan(x)}
        for row, points in changes.items()
    }
    patch.replace_cells(table.separator, len(found.frames), new, 7 if scale > 0.1 else 4)
    return patch.encoded()
