"""The table of all layouts of calibrations that are read. `docs/log/recordings.md` lists it."""

from functools import cache

from tracker.compute.extensions import usable
from tracker.formats.calibrations import data_layouts as data
from tracker.formats.calibrations import dataset_layouts as sets
from tracker.formats.calibrations import motion_capture as mocap
from tracker.formats.calibrations import text_layouts as text
from tracker.formats.calibrations.calibration_layout import OPENCV_POSES, CalibrationLayout
from tracker.formats.calibrations.document import Document, at_top, in_groups, in_rows

_MAYACAM = "MayaCam files state no unit: they are read in centimetres, as Maya counts."
# fmt: off
_OWN: tuple[CalibrationLayout, ...] = (
    CalibrationLayout("Kalibr (`camchain.yaml`)", "groups with `camera_model` and `intrinsics`",
        "each camera from the one before; the first defines the world", "m", in_groups("camera_model", "intrinsics"),
        data.read_kalibr),
    CalibrationLayout("MC-Calib", "`camera_pose_matrix` in groups", "X_world = R X_camera + t", None,
        in_groups("camera_pose_matrix"), data.read_mc_calib),
    CalibrationLayout("multical", "groups `cameras` and `camera_poses`", OPENCV_POSES, None,
        lambda document: {"cameras", "camera_poses"} <= document.groups.keys(), data.read_multical),
    CalibrationLayout("CMU Panoptic", "the key `calibDataSource`", OPENCV_POSES, "cm", at_top("calibDataSource"),
        data.read_words),
    CalibrationLayout("JARVIS (one file for each camera)", "`intrinsicMatrix`, `R` and `T`",
        "row vectors: K and R are transposed", "mm", in_rows("intrinsicMatrix", "R", "T"), data.read_row_vectors),
    CalibrationLayout("DANNCE (`jsonencode(params)`)", "`K`, `RDistort`, `r` and `t`",
        "row vectors: K and r are transposed", "mm", in_rows("K", "RDistort", "r", "t"), data.read_row_vectors,
        note="The principal points are read as DANNCE uses them. MATLAB counts pixels from 1: subtract 1 from both "
            "numbers if its calibrator has made the file."),
    CalibrationLayout("OpenPose (one file for each camera)", "`CameraMatrix` (3x4) and `Intrinsics`", OPENCV_POSES,
        None, at_top("CameraMatrix", "Intrinsics"), data.read_openpose, by_program=False),
    CalibrationLayout("EasyMocap (`intri.yml` and `extri.yml`)", "`K_NAME`, or `R_NAME` and `T_NAME`", OPENCV_POSES,
        None, data.is_easymocap, data.read_words, by_program=False, join=data.join_easymocap,
        halves=("intri.", "extri.")),
    CalibrationLayout("Caliscope (`camera_array.toml`)", "sections below `cameras`", OPENCV_POSES, None,
        data.is_caliscope, data.read_caliscope),
    CalibrationLayout("Caliscope before 0.5, pyxy3d (`config.toml`)", "sections with `port` or `cam_id` at the top",
        OPENCV_POSES, None, data.is_pyxy3d, data.read_top_sections),
    CalibrationLayout("FreeMoCap", "`charuco_...` in `metadata`", OPENCV_POSES, None, data.is_freemocap,
        data.read_top_sections),
    CalibrationLayout("anipose, Pose2Sim (`Calib.toml`)", "TOML sections with `matrix`, `rotation` and `translation`",
        OPENCV_POSES, None, data.is_anipose, data.read_top_sections, by_program=False),
    CalibrationLayout("AIST++ and other lists of anipose's cameras", "a list with anipose's keys", OPENCV_POSES, None,
        data.is_aniposelib, data.read_words, by_program=False),
    CalibrationLayout("Qualisys (`.qca.txt`)", "XML `calibration` with `cameras`",
        "place and world-to-camera rotation, y up and z backwards", "mm", mocap.is_qualisys, mocap.read_qualisys),
    CalibrationLayout("Vicon (`.xcp`)", "XML with `KeyFrames`",
        "place and world-to-camera quaternion; without lens distortion", "mm", mocap.is_vicon, mocap.read_vicon),
    CalibrationLayout("Skeletool: MPI-INF-3DHP, DynaCap, Captury (`camera.calibration`)",
        "the first line `Skeletool Camera Calibration File`", OPENCV_POSES, "mm", text.is_skeletool,
        text.read_skeletool),
    CalibrationLayout("MayaCam 2 of XMALab and Autoscoper (one file for each camera)",
        "lines `image size`, `camera matrix`, `rotation` and `translation`", OPENCV_POSES, "cm", text.is_mayacam2,
        text.read_mayacam2, is_unit_sure=False, note=_MAYACAM),
    CalibrationLayout("MayaCam 1 (one file for each camera)", "five lines of three numbers",
        "place and angles about x, y and z, y up and z backwards", "cm", text.is_mayacam1, text.read_mayacam1,
        is_unit_sure=False, note=_MAYACAM),
    CalibrationLayout("DLT coefficients of DLTdv, Argus and easyWand (`dltCoefs.csv`)",
        "eleven lines with a number for each camera",
        "a projection, which is split into K, R and t; without lens distortion", None, text.is_dlt, text.read_dlt,
        note="DLT coefficients describe no lens distortion: footage of a lens that bends lines is undistorted first."),
    CalibrationLayout("COLMAP (`cameras.txt` and `images.txt`)",
        "lines with a model of a lens, or with a quaternion, a place and a picture", OPENCV_POSES, None, text.is_colmap,
        text.read_colmap, note="COLMAP finds no scale by itself: check that its model was scaled.",
        halves=("cameras.", "images."), join=text.join_colmap),
    CalibrationLayout("Ego-Exo4D (`gopro_calibs.csv`)", "a table with `cam_uid` and `tx_world_cam`",
        "X_world = R X_camera + t", "m", text.is_egoexo, text.read_egoexo),
    CalibrationLayout("XRMoCap, XRPrimer (one file for each camera)", "`extrinsic_r`, `extrinsic_t` and `world2cam`",
        "by `world2cam`, in OpenCV's axes", "m", at_top("extrinsic_r", "extrinsic_t", "world2cam"), sets.read_xrmocap),
    CalibrationLayout("VoxelPose: Shelf, Campus", "`R`, `T`, `fx`, ... with the lens as `k` and `p`",
        "X_camera = R (X_world - T)", "mm", in_rows("R", "T", "fx", "fy", "cx", "cy", "k", "p"), sets.read_voxelpose),
    CalibrationLayout("Google's light fields (`models.json`), Nerfies",
        "`orientation` and `position` with `focal_length`", "X_camera = R (X_world - position)", None,
        in_rows("orientation", "position", "focal_length", "principal_point"), sets.read_google),
    CalibrationLayout("calib.io", "`Calibration` with `cameras` and their `model`", OPENCV_POSES, None,
        sets.is_calib_io, sets.read_calib_io),
    CalibrationLayout("MVHumanNet (`camera_extrinsics.json`, with `camera_scale.pkl` beside it)",
        "`rotation`, `translation`, `focal_length` and `image_center`", OPENCV_POSES, "mm",
        in_rows("rotation", "translation", "focal_length", "image_center"), sets.read_mvhumannet),
    CalibrationLayout("Wildtrack (`intr_NAME.xml` and `extr_NAME.xml`)",
        "XML with a lens alone, or with `rvec` and `tvec` alone", OPENCV_POSES, "cm", sets.is_wildtrack,
        data.read_words, join=sets.join_wildtrack, halves=("intr_", "extr_")),
    CalibrationLayout("OpenCV's words in JSON, YAML or XML", "a matrix under `K`, `camera_matrix`, ... of each camera",
        OPENCV_POSES, None, data.has_cameras, data.read_words, by_program=False),
)
# fmt: on


@cache
def layouts() -> tuple[CalibrationLayout, ...]:
    """Return the layouts in the order in which they are tried: those of other packages come first."""
    return (*usable("quadrille.calibrations", CalibrationLayout, [layout.name for layout in _OWN]).values(), *_OWN)


def find_layout(document: Document) -> CalibrationLayout | None:
    """Return the layout of a file by its content; None if it is of none."""
    return next((layout for layout in layouts() if layout.recognizes(document)), None)
