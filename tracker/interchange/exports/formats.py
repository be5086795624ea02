"""The formats that a session is exported to, one entry each. Another format is a writer and an entry here.

Other packages add theirs by an entry point (`tracker.compute.extensions`), and so does `app` with its overlay video.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from tracker.compute.extensions import Extended
from tracker.errors import Remedy, TrackerError

if TYPE_CHECKING:
    from tracker.interchange.exports.motion import AxesName, ExportedMotion, ExportOptions, UnitName

Tick = Callable[[], None]
"""Called after each frame of each file; it may raise to stop the export."""
Writer = Callable[["ExportedMotion", "ExportOptions", Sequence[Path], Tick], None]
"""Writes a motion to the files of one format, and calls the function after each frame."""


@dataclass(frozen=True)
class ExportFormat:
    """A format that a session is exported to."""

    name: str
    """By which the command line and the page refer to it."""
    title: str
    """Its content, for people."""
    suffixes: tuple[str, ...]
    """End of the name of each file; the first names the format."""
    write: Writer
    options: frozenset[str] = frozenset()
    """Options that it has, some of `OPTIONS`."""
    one_person: bool = False
    """Whether each person gets files of their own."""
    axes: "AxesName" = "calibration"
    """Axes by default, as programs that read it expect them."""
    units: "UnitName" = "m"
    """Unit of lengths by default."""
    gaps: str = "left empty"
    """Treatment of frames without a pose."""
    numbering: str = ""
    """Sentence on its frame numbers where they are not the session's, of `{frame}` and `{number}`, 1 more."""
    one_body: bool = False
    """Whether all poses of a person are of one body; those of earlier sizes are refitted."""
    has_rate: bool = False
    """Whether its frames have a constant rate; those between the exported ones are then like frames without a pose."""
    is_folder: bool = False
    """Whether it is a folder of files; the first suffix ends its name if it is named after the session."""
    holds_provenance: bool = False
    """Whether its own files hold the provenance of the poses."""


def _by_writer(name: str, module: str = "writers") -> Writer:
    """Return a function of a module of `tracker.interchange.exports`, imported when first used: help is quick."""

    def write(motion: "ExportedMotion", options: "ExportOptions", paths: Sequence[Path], tick: Tick) -> None:
        getattr(import_module(f"tracker.interchange.exports.{module}"), name)(motion, options, paths, tick)

    return write


OPTIONS = ("axes", "units", "view", "keypoints", "pixels", "pictures", "character", "mesh", "faces")
"""Options that a format may have, the fields of `ExportOptions`."""
_PLACE = frozenset(("axes", "units"))
_FROM_1 = "counts from 1: frame {frame} of the session is"
# fmt: off
_OWN: Mapping[str, ExportFormat] = {f.name: f for f in (
    ExportFormat("trc", "joint centers (TRC)", (".trc",), _by_writer("write_person_trc"), _PLACE, one_person=True,
        has_rate=True, numbering=f"Frame# {_FROM_1} Frame# {{number}}"),
    ExportFormat("csv", "tables of joints and angles (CSV)", (".csv", "_angles.csv"), _by_writer("write_tables"),
        _PLACE),
    ExportFormat("mot", "OpenSim motion with its model (MOT, OSIM)", (".mot", ".osim"),
        _by_writer("write_person_opensim"), frozenset(("axes",)), one_person=True, axes="y-up", gaps="left out",
        one_body=True),
    ExportFormat("coco", "keypoints in each view (COCO)", (".json",), _by_writer("write_keypoints"),
        frozenset(("keypoints",)), gaps="left without annotation"),
    ExportFormat("bvh", "skeleton animation (BVH)", (".bvh",), _by_writer("write_person_bvh"), _PLACE, one_person=True,
        axes="y-up", gaps="interpolated", one_body=True, has_rate=True),
    ExportFormat("glb", "animated skeleton (glTF)", (".glb",), _by_writer("write_animation"), axes="y-up",
        gaps="interpolated by viewers", one_body=True),
    ExportFormat("meshes", "bodies as meshes (PLY, OBJ, STL, GLB)", ("_meshes",),
        _by_writer("write_bodies", "mesh_writers"), _PLACE | {"mesh"}, gaps="left out", is_folder=True),
    ExportFormat("hulls", "visual hulls as meshes (PLY, OBJ, STL, GLB)", ("_hulls",),
        _by_writer("write_hulls", "mesh_writers"), _PLACE | {"mesh"}, gaps="left out where nobody is seen",
        is_folder=True),
    ExportFormat("scene", "one frame with cameras and pictures (glTF)", (".glb",),
        _by_writer("write_scene", "mesh_writers"), frozenset(("faces",)), axes="y-up", gaps="left out"),
    ExportFormat("c3d", "joint centers (C3D)", (".c3d",), _by_writer("write_person_c3d"), _PLACE,
        one_person=True, units="mm", has_rate=True, numbering=f"C3D {_FROM_1} frame {{number}} of the file"),
    ExportFormat("openpose", "keypoints (OpenPose)", ("_openpose",), _by_writer("write_points", "label_writers"),
        frozenset(("pixels", "faces")), gaps="left without people", is_folder=True),
    ExportFormat("masks", "masks of parts (PNG)", ("_masks",), _by_writer("write_masks", "label_writers"),
        frozenset(("pixels", "faces")), gaps="left without people", is_folder=True),
    ExportFormat("movement", "poses (movement, netCDF)", (".nc", "_views.nc"),
        _by_writer("write_movement"), frozenset(("axes",)), gaps="left as NaN", has_rate=True,
        holds_provenance=True),
    ExportFormat("nwb", "poses (NWB, ndx-pose)", (".nwb",), _by_writer("write_poses_nwb", "nwb_writer"),
        frozenset(("axes",)), gaps="left as NaN", has_rate=True, holds_provenance=True),
    ExportFormat("npz", "poses and cameras (NPZ)", (".npz",), _by_writer("write_npz"),
        frozenset(("axes",)), gaps="left as NaN", holds_provenance=True),
    ExportFormat("dataset", "dataset of pictures and labels", ("_dataset",),
        _by_writer("write_dataset", "datasets.dataset"), frozenset(("keypoints", "pixels", "pictures", "faces")),
        gaps="left without people", is_folder=True),
)}
# fmt: on
FORMATS = Extended(_OWN, "quadrille.exporters", ExportFormat)
"""All formats by name."""


def find_format(name: str | None, out: Path) -> ExportFormat:
    """Return a format by name, or without one by the suffix of a file.

    Raises:
        TrackerError: there is no such format.
    """
    if name is not None and name in FORMATS:
        return FORMATS[name]
    by_suffix = next((f for f in FORMATS.values() if f.suffixes[0] == out.suffix.lower()), None)
    if name is None and by_suffix is not None:
        return by_suffix
    found = f"'{name}'" if name is not None else f"none, and no known suffix in '{out.name}'"
    raise TrackerError(f"expected a format among {', '.join(FORMATS)}, found {found}", Remedy("name_format"))
