"""The table of all layouts of calibrations that are read. `docs/recordings.md` lists it."""

from collections.abc import Callable
from dataclasses import dataclass

from tracker.calibrations import data_layouts as data
from tracker.calibrations import motion_capture as mocap
from tracker.calibrations import toml_layouts as toml
from tracker.calibrations.camera_words import Section
from tracker.calibrations.document import Document
from tracker.formats.camera_section import Units


@dataclass(frozen=True)
class CalibrationLayout:
    """One way in which programs write calibrated cameras."""

    name: str
    """Name for people."""
    recognized_by: str
    """Content by which it is recognized."""
    poses: str
    """Convention of its poses, which is turned to `X_camera = R X_world + t`."""
    unit: Units | None
    """Unit of its translations; None if it does not fix one."""
    recognizes: Callable[[Document], bool]
    read: Callable[[Document], dict[str, Section]]
    """Reads the cameras of one file by their names. The name of a lone camera without one is empty: its file's."""
    by_program: bool = True
    """Whether programs alone write it, so that its convention is beyond doubt where it fits."""

    @property
    def poses_in_words(self) -> str:
        """The convention of its poses, for messages."""
        is_opencv = self.poses == _OPENCV
        return f"poses that map world to camera ({_OPENCV})" if is_opencv else f"poses of {self.name}: {self.poses}"


_OPENCV = "X_camera = R X_world + t"

LAYOUTS: tuple[CalibrationLayout, ...] = (
    CalibrationLayout(
        "Kalibr (`camchain.yaml`)",
        "groups with `camera_model` and `intrinsics`",
        "each camera from the one before; the first defines the world",
        "m",
        data.is_kalibr,
        data.read_kalibr,
    ),
    CalibrationLayout(
        "MC-Calib",
        "`camera_pose_matrix` in groups",
        "X_world = R X_camera + t",
        None,
        data.is_mc_calib,
        data.read_mc_calib,
    ),
    CalibrationLayout(
        "multical", "groups `cameras` and `camera_poses`", _OPENCV, None, data.is_multical, data.read_multical
    ),
    CalibrationLayout("CMU Panoptic", "the key `calibDataSource`", _OPENCV, "cm", data.is_panoptic, data.read_words),
    CalibrationLayout(
        "JARVIS (one file for each camera)",
        "`intrinsicMatrix`, `R` and `T`",
        "row vectors: K and R are transposed",
        "mm",
        data.is_jarvis,
        data.read_row_vectors,
    ),
    CalibrationLayout(
        "DANNCE (`jsonencode(params)`)",
        "`K`, `RDistort`, `r` and `t`",
        "row vectors: K and r are transposed",
        "mm",
        data.is_dannce,
        data.read_row_vectors,
    ),
    CalibrationLayout(
        "OpenPose (one file for each camera)",
        "`CameraMatrix` (3x4) and `Intrinsics`",
        _OPENCV,
        None,
        data.is_openpose,
        data.read_openpose,
        by_program=False,
    ),
    CalibrationLayout(
        "EasyMocap (`intri.yml` and `extri.yml`)",
        "`K_NAME`, or `R_NAME` and `T_NAME`",
        _OPENCV,
        None,
        data.is_easymocap,
        data.read_words,
        by_program=False,
    ),
    CalibrationLayout(
        "Caliscope (`camera_array.toml`)",
        "sections below `cameras`",
        _OPENCV,
        None,
        toml.is_caliscope,
        toml.read_caliscope,
    ),
    CalibrationLayout(
        "Caliscope before 0.5, pyxy3d (`config.toml`)",
        "sections with `port` or `cam_id` at the top",
        _OPENCV,
        None,
        toml.is_pyxy3d,
        toml.read_top_sections,
    ),
    CalibrationLayout(
        "FreeMoCap", "`charuco_...` in `metadata`", _OPENCV, None, toml.is_freemocap, toml.read_top_sections
    ),
    CalibrationLayout(
        "anipose, Pose2Sim (`Calib.toml`)",
        "TOML sections with `matrix`, `rotation` and `translation`",
        _OPENCV,
        None,
        toml.is_anipose,
        toml.read_top_sections,
        by_program=False,
    ),
    CalibrationLayout(
        "AIST++ and other lists of anipose's cameras",
        "a list with anipose's keys",
        _OPENCV,
        None,
        data.is_aniposelib,
        data.read_words,
        by_program=False,
    ),
    CalibrationLayout(
        "Qualisys (`.qca.txt`)",
        "XML `calibration` with `cameras`",
        "place and world-to-camera rotation, y up and z backwards",
        "mm",
        mocap.is_qualisys,
        mocap.read_qualisys,
    ),
    CalibrationLayout(
        "Vicon (`.xcp`)",
        "XML with `KeyFrames`",
        "place and world-to-camera quaternion; without lens distortion",
        "mm",
        mocap.is_vicon,
        mocap.read_vicon,
    ),
    CalibrationLayout(
        "OpenCV's words in JSON, YAML or XML",
        "a matrix under `K`, `camera_matrix`, ... of each camera",
        _OPENCV,
        None,
        data.has_cameras,
        data.read_words,
        by_program=False,
    ),
)
"""In the order in which they are tried: those that share words with others first."""


def find_layout(document: Document) -> CalibrationLayout | None:
    """Return the layout of a file by its content; None if it is of none."""
    return next((layout for layout in LAYOUTS if layout.recognizes(document)), None)


def markdown_table() -> str:
    """Return the table for documents."""
    rows = ["| layout | recognized by | poses | unit |", "|---|---|---|---|"]
    for layout in LAYOUTS:
        poses = f"`{layout.poses}`" if "=" in layout.poses else layout.poses
        rows.append(f"| {layout.name} | {layout.recognized_by} | {poses} | {layout.unit or 'given, else m'} |")
    return "\n".join(rows) + "\n"
