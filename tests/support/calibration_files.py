"""Write the same cameras in the layout of each program, as the program does."""

import json

import cv2
import numpy as np
import tomli_w

from tracker.calibrations.writing import anipose_section, anipose_text, caliscope_text
from tracker.geometry import rigid


def parts(c):
    """Return K, distortion, R and t of a camera, world to camera, metres."""
    return c.K, c.distortion, c.T_camera_world[:3, :3], c.T_camera_world[:3, 3]


def to_json(path, data):
    path.write_text(json.dumps(data, default=lambda a: a.tolist()))
    return path


def to_storage(path, values):
    """Write nested values by OpenCV itself."""
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)

    def write(name, value):
        if isinstance(value, dict):
            storage.startWriteStruct(name, cv2.FileNode_MAP)
            for key, inner in value.items():
                write(key, inner)
            storage.endWriteStruct()
        else:
            storage.write(name, value)

    for key, value in values.items():
        write(key, value)
    storage.release()
    return path


def anipose(folder, cameras, metadata=None):
    path = folder / "Calib.toml"
    path.write_text(anipose_text(cameras, metadata))
    return path


def freemocap(folder, cameras):
    return anipose(folder, cameras, {"charuco_square_size": 58.0, "charuco_board_object": "7x5"})


def caliscope(folder, cameras):
    path = folder / "camera_array.toml"
    path.write_text(caliscope_text(cameras))
    return path


def pyxy3d(folder, cameras):
    sections = {
        f"cam_{i}": {"port": i, "error": 0.4, "exposure": -7, "verified_resolutions": [[640, 480]]}
        | anipose_section(c)
        | {"rotation": parts(c)[2].tolist()}
        for i, c in enumerate(cameras)
    }
    more = {"capture_volume": {"stage": 2}, "charuco": {"columns": 4, "units": "inch", "inverted": True}}
    path = folder / "config.toml"
    path.write_text(tomli_w.dumps({"camera_count": len(cameras)} | sections | more))
    return path


def aist(folder, cameras):
    return to_json(folder / "setting1.json", [{"name": c.name} | anipose_section(c) for c in cameras])


def panoptic(folder, cameras):
    rows = []
    for i, c in enumerate(cameras):
        K, distortion, R, t = parts(c)
        rows.append({"name": c.name, "type": "hd", "resolution": list(c.size), "panel": 0, "node": i, "K": K,
                     "distCoef": distortion, "R": R, "t": 100 * t[:, None]})  # fmt: skip
    return to_json(folder / "calibration_160422.json", {"calibDataSource": "160422", "cameras": rows})


def kalibr(folder, cameras):
    lines, before = ["%YAML 1.2", "---"], None
    for c in cameras:
        fx, _, cx, _, fy, cy = c.K.ravel()[:6]
        lines += [f"{c.name}:", "  camera_model: pinhole", "  distortion_model: radtan", f"  rostopic: /{c.name}"]
        lines += [f"  intrinsics: [{fx}, {fy}, {cx}, {cy}]", f"  resolution: {list(c.size)}"]
        lines += [f"  distortion_coeffs: {c.distortion[:4].tolist()}"]
        if before is not None:
            lines += ["  T_cn_cnm1:"]
            lines += [f"  - {row}" for row in (c.T_camera_world @ before.T_world_camera).tolist()]
        before = c
    path = folder / "camchain.yaml"
    path.write_text("\n".join(lines))
    return path


def multical(folder, cameras):
    lenses = {
        c.name: {"model": "standard", "image_size": list(c.size), "K": c.K, "dist": c.distortion[None]} for c in cameras
    }
    poses = {
        (f"{c.name}_to_{cameras[0].name}" if i else c.name): {"R": parts(c)[2], "T": parts(c)[3]}
        for i, c in enumerate(cameras)
    }
    images = {"rgb": [{c.name: f"{c.name}/0.jpg" for c in cameras}]}
    return to_json(folder / "calibration.json", {"cameras": lenses, "camera_poses": poses, "image_sets": images})


def mc_calib(folder, cameras):
    groups = {
        f"camera_{i}": {
            "camera_matrix": c.K, "distortion_vector": c.distortion[None], "distortion_type": 0, "camera_group": 0,
            "img_width": c.width, "img_height": c.height, "camera_pose_matrix": c.T_world_camera,
        }
        for i, c in enumerate(cameras)
    }  # fmt: skip
    return to_storage(folder / "calibrated_cameras_data.yml", {"nb_camera": len(cameras)} | groups)


def jarvis(folder, cameras):
    for c in cameras:
        K, distortion, R, t = parts(c)
        values = {"intrinsicMatrix": np.ascontiguousarray(K.T), "distortionCoefficients": distortion[None]}
        values |= {"R": np.ascontiguousarray(R.T), "T": 1000 * t[:, None]}
        to_storage(folder / f"{c.name}.yaml", values)
    return folder


def dannce(folder, cameras):
    groups = {}
    for c in cameras:
        K, distortion, R, t = parts(c)
        groups[c.name] = {"K": K.T, "RDistort": distortion[:2], "TDistort": distortion[2:4], "r": R.T, "t": 1000 * t}
    return to_json(folder / "params.json", groups)


def openpose(folder, cameras):
    for c in cameras:
        K, distortion, R, t = parts(c)
        values = {"CameraMatrix": np.hstack([R, t[:, None]]), "Intrinsics": K}
        to_storage(folder / f"{c.name}.xml", values | {"Distortion": np.pad(distortion, (0, 4))[:8, None]})
    return folder


def easymocap(folder, cameras):
    intri, extri = {"names": [c.name for c in cameras]}, {"names": [c.name for c in cameras]}
    for c in cameras:
        K, distortion, R, t = parts(c)
        intri |= {f"K_{c.name}": K, f"dist_{c.name}": np.append(distortion[:4], 0.0)[None]}
        extri |= {f"R_{c.name}": rigid.so3_log(R)[:, None], f"Rot_{c.name}": R, f"T_{c.name}": t[:, None]}
    to_storage(folder / "intri.yml", intri)
    return to_storage(folder / "extri.yml", extri)


def qualisys(folder, cameras, scale=1.0, version="2023.1"):
    """XML of QTM: the sensor in 64ths of a pixel, axes with y up and z backwards, places in millimetres."""
    rows = []
    for c in cameras:
        K, distortion, R, _ = parts(c)
        M, p = np.diag([1, -1, -1]) @ R, 1000 * c.center_world
        turn = " ".join(f'r{i + 1}{j + 1}="{M[i, j]:.17g}"' for i in range(3) for j in range(3))
        lens = zip(("radialDistortion1", "radialDistortion2", "tangentalDistortion1", "tangentalDistortion2"),
                   scale * distortion, strict=True)  # fmt: skip
        rows.append(
            f'<camera active="1" serial="{c.name}" model="Miqus Video" viewrotation="0">'
            f'<fov_video left="0" top="0" right="{c.width - 1}" bottom="{c.height - 1}"/>'
            f'<transform x="{p[0]:.17g}" y="{p[1]:.17g}" z="{p[2]:.17g}" {turn}/>'
            f'<intrinsic sensorMinU="0" sensorMaxU="{64 * c.width - 1}" focalLengthU="{64 * K[0, 0]}" '
            f'focalLengthV="{64 * K[1, 1]}" centerPointU="{64 * K[0, 2]}" centerPointV="{64 * K[1, 2]}" skew="0" '
            + " ".join(f'{key}="{value:.17g}"' for key, value in lens)
            + "/></camera>"
        )
    path = folder / "session.qca.txt"
    path.write_text(f'<calibration qtm-version="{version}"><cameras>{"".join(rows)}</cameras></calibration>')
    return path


def vicon(folder, cameras):
    rows = []
    for c in cameras:
        w, x, y, z = rigid.quaternion_from_matrix(c.T_camera_world[:3, :3])
        p = 1000 * c.center_world
        rows.append(
            f'<Camera DEVICEID="{c.name}" SENSOR_SIZE="{c.width} {c.height}" PIXEL_ASPECT_RATIO="1" TYPE="Video">'
            f'<KeyFrames><KeyFrame FOCAL_LENGTH="{c.K[0, 0]}" PRINCIPAL_POINT="{c.K[0, 2]} {c.K[1, 2]}" '
            f'ORIENTATION="{x:.17g} {y:.17g} {z:.17g} {w:.17g}" POSITION="{p[0]:.17g} {p[1]:.17g} {p[2]:.17g}" '
            f'VICON_RADIAL2="ViconRadial2 {c.K[0, 2]} {c.K[1, 2]} 0 0 0"/></KeyFrames></Camera>'
        )
    path = folder / "studio.xcp"
    path.write_text(f"<?xml version='1.0'?><Cameras>{''.join(rows)}</Cameras>")
    return path


def opencv_words(folder, cameras):
    words = {}
    for c in cameras:
        K, distortion, R, t = parts(c)
        words[c.name] = {"camera_matrix": K, "dist_coeffs": distortion, "R": R, "T": t, "image_size": list(c.size)}
    return to_json(folder / "cameras.json", words)


WRITERS = {
    "Kalibr (`camchain.yaml`)": kalibr,
    "MC-Calib": mc_calib,
    "multical": multical,
    "CMU Panoptic": panoptic,
    "JARVIS (one file for each camera)": jarvis,
    "DANNCE (`jsonencode(params)`)": dannce,
    "OpenPose (one file for each camera)": openpose,
    "EasyMocap (`intri.yml` and `extri.yml`)": easymocap,
    "Caliscope (`camera_array.toml`)": caliscope,
    "Caliscope before 0.5, pyxy3d (`config.toml`)": pyxy3d,
    "FreeMoCap": freemocap,
    "anipose, Pose2Sim (`Calib.toml`)": anipose,
    "AIST++ and other lists of anipose's cameras": aist,
    "Qualisys (`.qca.txt`)": qualisys,
    "Vicon (`.xcp`)": vicon,
    "OpenCV's words in JSON, YAML or XML": opencv_words,
}
"""Writers by the names of the layouts."""
