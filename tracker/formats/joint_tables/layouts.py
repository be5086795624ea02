"""The table of all layouts of joints in space that are known. `docs/observations.md` lists it."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TypeAlias

from tracker.errors import FormatError
from tracker.files import open_regular
from tracker.formats.joint_tables import columns as head
from tracker.formats.joint_tables import scenes
from tracker.formats.joint_tables.arrays import is_array, read_array
from tracker.formats.joint_tables.table_reading import read_table
from tracker.formats.observation_layout import ObservationLayout, Sample
from tracker.formats.trc import METRES_BY_WORD, MarkerTable

TableLayout: TypeAlias = ObservationLayout[list[MarkerTable]]
Scenes: TypeAlias = list[tuple[Path, MarkerTable]]
"""The points of each person, with the file or folder that they are from."""
_SECTIONS = {"Trajectories", "Devices", "Model Outputs", "Joints", "Segments", "Events"}
"""Sections of an ASCII file of Vicon Nexus."""


def _begins(sample: Sample, first: str) -> bool:
    """Return whether the first cell of a table begins with a word."""
    return any(cells[0].startswith(first) for cells in sample.cells[:1])


def _is_nexus(sample: Sample) -> bool:
    """Return whether a table begins with the name of a section alone."""
    return any({*cells} - {""} <= _SECTIONS and cells[0] for cells in sample.cells[:1])


def _rows(sample: Sample) -> list[set[str]]:
    return [{cell.lower() for cell in cells} for cells in sample.cells]


def _is_deeplabcut(sample: Sample) -> bool:
    rows = sample.cells[:4]
    return any(cells[0].lower() == "coords" and "z" in cells for cells in rows)


def _is_jarvis(sample: Sample) -> bool:
    rows = sample.cells
    return len(rows) > 1 and {*rows[1]} <= {"x", "y", "z", "confidence"} and "z" in rows[1]


def _is_long(sample: Sample) -> bool:
    return any({*head.NAMES} & row and {"z", "z_coord"} & row for row in _rows(sample)[:1])


def _is_wide(sample: Sample) -> bool:
    axes = {m["axis"].lower() for cells in sample.cells[:1] for c in cells if (m := head.COORDINATE.fullmatch(c))}
    return "z" in axes


def _is_of(suffixes: tuple[str, ...], first: bytes, sample: Sample) -> bool:
    """Return whether a file has one of some suffixes, or begins with some bytes."""
    if sample.path.suffix.lower() in suffixes:
        return True
    try:
        with open_regular(sample.path) as file:
            return bool(first) and file.read(len(first)) == first
    except OSError:
        return False


WIDE: TableLayout = ObservationLayout(
    "anipose, FreeMoCap, Caliscope (wide), Quadrille's tables of joints and others",
    "a `.csv` or `.tsv` for each person, or a column `person`",
    "columns `NAME_x`, `NAME_y`, `NAME_z`, perhaps with a unit",
    _is_wide,
    partial(read_table, head.named_columns),
)
TABLES: tuple[TableLayout, ...] = (
    ObservationLayout(
        "OptiTrack Motive",
        "a `.csv` for each take",
        "`Format Version` first; markers and bones",
        partial(_begins, first="Format Version"),
        partial(read_table, head.motive_columns),
    ),
    ObservationLayout(
        "Vicon Nexus (ASCII)",
        "a `.csv` for each trial",
        "the section `Trajectories`, or another one of Nexus first",
        _is_nexus,
        partial(read_table, head.nexus_columns),
    ),
    ObservationLayout(
        "Qualisys Track Manager",
        "a `.tsv` for each measurement, in mm",
        "`NO_OF_FRAMES` first, then `MARKER_NAMES`",
        partial(_begins, first="NO_OF_"),
        partial(read_table, head.qualisys_columns),
    ),
    ObservationLayout(
        "DeepLabCut 3-D, Lightning Pose and EKS (`multicam_3d_results.csv`)",
        "a `.csv`",
        "rows `scorer`, `bodyparts` and `coords` with z",
        _is_deeplabcut,
        partial(read_table, head.stacked_columns),
    ),
    ObservationLayout(
        "JARVIS (`data3D.csv`)",
        "a `.csv`",
        "names above x, y, z and confidence",
        _is_jarvis,
        partial(read_table, head.stacked_columns),
    ),
    ObservationLayout(
        "FreeMoCap (tidy), Caliscope (`xyz_TRACKER.csv`)",
        "a `.csv`",
        "columns `frame` or `sync_index`, `keypoint` or `point_id`, and x, y, z",
        _is_long,
        partial(read_table, head.named_columns),
    ),
    WIDE,
)
"""Tables, in the order in which they are tried."""
ARRAYS: TableLayout = ObservationLayout(
    "arrays of body-model networks: SMPL, SMPL-X, MHR and others",
    "a `.npy` or `.npz`",
    "shape (frames, joints, 3) or (frames, people, joints, 3)",
    is_array,
    read_array,
)
SCENES: tuple[ObservationLayout[Scenes], ...] = (
    ObservationLayout(
        "EasyMocap (`keypoints3d`)",
        "a `.json` for each frame",
        "`keypoints3d` of each person",
        scenes.is_easymocap,
        partial(scenes.read_scenes, scenes.easymocap_points, None),
    ),
    ObservationLayout(
        "CMU Panoptic (`hdPose3d`)",
        "a `.json` for each frame, in cm",
        "`bodies` with `joints19`",
        scenes.is_panoptic,
        partial(scenes.read_scenes, scenes.panoptic_points, METRES_BY_WORD["cm"]),
    ),
)
_ARRAY = "the joints in space as a NumPy array (frames, joints, 3), saved with numpy.save"
_C3D = "C3D with the joint centres as points"
NOT_READ: tuple[ObservationLayout[None], ...] = tuple(
    ObservationLayout(program, ", ".join(f"`{s}`" for s in suffixes), "", partial(_is_of, suffixes, first), None, new)
    for program, suffixes, first, new in (
        ("FBX", (".fbx",), b"Kaydara FBX", "BVH"),
        ("glTF", (".glb", ".gltf"), b"glTF", "BVH"),
        ("a Python pickle, as fits of SMPL", (".pkl", ".pickle"), b"\x80", _ARRAY),
        ("a MATLAB file", (".mat",), b"MATLAB", "a CSV with columns NAME_x, NAME_y, NAME_z (writetable)"),
        ("a workbook of Excel", (".xlsx", ".xls"), b"", "it as CSV"),
        ("Parquet, as of FreeMoCap", (".parquet",), b"PAR1", "CSV, which FreeMoCap writes beside it"),
        ("a file of Visual3D or Theia", (".cmz", ".cmo", ".p3d"), b"", _C3D),
        ("a project of Motive, Nexus or Qualisys Track Manager", (".tak", ".x2d", ".qtm"), b"", "C3D or a table"),
    )
)
"""Files that are known by name alone."""


def find_table(sample: Sample) -> TableLayout | None:
    """Return the layout of a table by its content; None if it is of none."""
    return next((layout for layout in TABLES if layout.recognizes(sample)), None)


def find_scenes(sample: Sample) -> ObservationLayout[Scenes] | None:
    """Return the layout of a JSON file with the people of a frame in space; None if it is of none."""
    return next((layout for layout in SCENES if layout.recognizes(sample)), None)


def refuse_unread(sample: Sample) -> None:
    """Name a file that is known and not read.

    Raises:
        FormatError: it is one.
    """
    for layout in NOT_READ:
        if layout.recognizes(sample):
            raise FormatError(
                f"expected joints, key points or masks, found {layout.program} in {sample.path}; export "
                f"{layout.instead}"
            )


def read_tables(paths: Sequence[Path], unit_m: float | None, rate: float) -> Scenes:
    """Read tables and arrays, each of one or several people. Raises as `read_table` and `read_array` do."""
    found = [(path, ARRAYS if is_array(Sample(path)) else find_table(Sample(path)) or WIDE) for path in paths]
    return [(path, table) for path, layout in found if layout.read for table in layout.read(path, unit_m, rate)]


def read_scenes(paths: Sequence[Path], unit_m: float | None, rate: float) -> Scenes:
    """Read JSON files of a frame each, all of one program. Raises as `scenes.read_scenes` does."""
    layout = next(filter(None, (find_scenes(Sample(path)) for path in paths)), SCENES[0])
    return layout.read(paths, unit_m, rate) if layout.read else []


def markdown_table() -> str:
    """Return the table for documents."""
    rows = ["| program | files | recognized by |", "|---|---|---|"]
    rows += [f"| {x.program} | {x.files} | {x.recognized_by} |" for x in (*TABLES, *SCENES, ARRAYS)]
    rows += [f"| {x.program} | {x.files} | not read: export {x.instead} |" for x in NOT_READ]
    return "\n".join(rows) + "\n"
