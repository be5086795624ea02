"""The table of all layouts of calibrations that are read. `docs/recordings.md` lists it."""

from functools import cache

from tracker.calibrations import data_layouts as data
from tracker.calibrations import motion_capture as mocap
from tracker.calibrations import toml_layouts as toml
from tracker.calibrations.calibration_layout import OPENCV_POSES, CalibrationLayout
from tracker.calibrations.document import Document
from tracker.compute.extensions import usable

_OWN: tuple[CalibrationLayout, ...] = (
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
        "multical", "groups `cameras` and `camera_poses`", OPENCV_POSES, None, data.is_multical, data.read_multical
    ),
    CalibrationLayout(
        "CMU Panoptic", "the key `calibDataSource`", OPENCV_POSES, "cm", data.is_panoptic, data.read_words
    ),
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
        note="The principal points are read as DANNCE uses them. MATLAB counts pixels from 1: subtract 1 from both "
        "numbers if its calibrator has made the file.",
    ),
    CalibrationLayout(
        "OpenPose (one file for each camera)",
        "`CameraMatrix` (3x4) and `Intrinsics`",
        OPENCV_POSES,
        None,
        data.is_openpose,
        data.read_openpose,
        by_program=False,
    ),
    CalibrationLayout(
        "EasyMocap (`intri.yml` and `extri.yml`)",
        "`K_NAME`, or `R_NAME` and `T_NAME`",
        OPENCV_POSES,
        None,
        data.is_easymocap,
        data.read_words,
        by_program=False,
    ),
    CalibrationLayout(
        "Caliscope (`camera_array.toml`)",
        "sections below `cameras`",
        OPENCV_POSES,
        None,
        toml.is_caliscope,
        toml.read_caliscope,
    ),
    CalibrationLayout(
        "Caliscope before 0.5, pyxy3d (`config.toml`)",
        "sections with `port` or `cam_id` at the top",
        OPENCV_POSES,
        None,
        toml.is_pyxy3d,
        toml.read_top_sections,
    ),
    CalibrationLayout(
        "FreeMoCap", "`charuco_...` in `metadata`", OPENCV_POSES, None, toml.is_freemocap, toml.read_top_sections
    ),
    CalibrationLayout(
        "anipose, Pose2Sim (`Calib.toml`)",
        "TOML sections with `matrix`, `rotation` and `translation`",
        OPENCV_POSES,
        None,
        toml.is_anipose,
        toml.read_top_sections,
        by_program=False,
    ),
    CalibrationLayout(
        "AIST++ and other lists of anipose's cameras",
        "a list with anipose's keys",
        OPENCV_POSES,
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
        OPENCV_POSES,
        None,
        data.has_cameras,
        data.read_words,
        by_program=False,
    ),
)


@cache
def layouts() -> tuple[CalibrationLayout, ...]:
    """Return the layouts in the order in which they are tried: those of other packages come first."""
    return (*usable("quadrille.calibrations", CalibrationLayout, [layout.name for layout in _OWN]).values(), *_OWN)


def find_layout(document: Document) -> CalibrationLayout | None:
    """Return the layout of a file by its content; None if it is of none."""
    return next((layout for layout in layouts() if layout.recognizes(document)), None)


def markdown_table() -> str:
    """Return the table for documents."""
    rows = ["| layout | recognized by | poses | unit |", "|---|---|---|---|"]
    for layout in layouts():
        poses = f"`{layout.poses}`" if "=" in layout.poses else layout.poses
        rows.append(f"| {layout.name} | {layout.recognized_by} | {poses} | {layout.unit or 'given, else m'} |")
    return "\n".join(rows) + "\n"
