"""Write the same cameras in the layout of each program, as the program does."""

import json
import pickle
from dataclasses import replace

import cv2
import numpy as np
import tomli_w
from scipy.spatial.transform import Rotation

from tracker.formats.anipose import anipose_section
from tracker.formats.calibrations.writing import anipose_text, caliscope_text
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


def lines(path, rows):
    path.write_text("\n".join(rows) + "\n")
    return path


def words(array):
    return " ".join(f"{value:.17g}" for value in np.ravel(array))


def skeletool(folder, cameras):
    rows = ["Skeletool Camera Calibration File V1.0"]
    for c in cameras:
        K, T = np.eye(4), c.T_camera_world.copy()
        K[:3, :3] = c.K
        T[:3, 3] *= 1000
        rows += [f"name          {c.name}", "  sensor      10 10", f"  size        {c.width} {c.height}"]
        rows += ["  animated    0", f"  intrinsic   {words(K)} ", f"  extrinsic   {words(T)} ", "  radial      0"]
    return lines(folder / "camera.calibration", rows)


def comma_rows(array):
    return [",".join(f"{value:.17g}" for value in row) for row in np.atleast_2d(array)]


def mayacam2(folder, cameras):
    for c in cameras:
        K, _, R, t = parts(c)
        rows = ["image size", f"{c.width},{c.height}", "", "camera matrix", *comma_rows(K), "", "rotation"]
        lines(folder / f"{c.name}.txt", [*rows, *comma_rows(R), "", "translation", *comma_rows(100 * t[:, None])])
    return folder


def mayacam1(folder, cameras):
    """Place, angles about the camera's own axes, the film, and its point below the centre, counted from 1."""
    for c in cameras:
        R = c.T_world_camera[:3, :3] @ np.diag([1.0, -1.0, -1.0])
        z, y, x = Rotation.from_matrix(R).as_euler("ZYX", degrees=True)
        film = [c.K[0, 2] + 1, c.height - c.K[1, 2], -c.K[0, 0]]
        table = [100 * c.center_world, [x, y, z], [0, 0, -1], film, [0.01, c.width, c.height]]
        lines(folder / f"{c.name}.csv", comma_rows(table))
    return folder


def dlt(folder, cameras):
    Ps = [c.K @ c.T_camera_world[:3] for c in cameras]
    return lines(folder / "dltCoefs.csv", comma_rows(np.array([(P / P[2, 3]).ravel()[:11] for P in Ps]).T))


def colmap(folder, cameras):
    lenses, pictures = ["# Camera list with one line of data per camera:"], ["# Image list with two lines of data:"]
    for i, c in enumerate(cameras):
        K, distortion, R, t = parts(c)
        lens = [K[0, 0], K[1, 1], K[0, 2] + 0.5, K[1, 2] + 0.5, *distortion[:4]]
        lenses.append(f"{i + 1} OPENCV {c.width} {c.height} {words(lens)}")
        q = rigid.quaternion_from_matrix(R)
        pictures += [f"{i + 1} {words(q)} {words(t)} {i + 1} {c.name}.png", "12.5 13.5 -1 30.25 8 4"]
    lines(folder / "cameras.txt", lenses)
    return lines(folder / "images.txt", pictures).with_name("cameras.txt")


def egoexo(folder, cameras):
    header = "cam_uid,graph_uid,tx_world_cam,ty_world_cam,tz_world_cam,qx_world_cam,qy_world_cam,qz_world_cam,"
    header += "qw_world_cam,image_width,image_height,intrinsics_type," + ",".join(f"intrinsics_{i}" for i in range(8))
    rows = [header]
    for c in cameras:
        w, x, y, z = rigid.quaternion_from_matrix(c.T_world_camera[:3, :3])
        lens = [c.K[0, 0], c.K[1, 1], c.K[0, 2], c.K[1, 2], *c.distortion]
        numbers = [
            *comma_rows([*c.center_world, x, y, z, w]),
            f"{c.width},{c.height},KANNALABRANDTK3",
            *comma_rows(lens),
        ]
        rows.append(",".join([c.name, "graph", *numbers]))
    return lines(folder / "gopro_calibs.csv", rows)


def xrmocap(folder, cameras, world2cam=True):
    for c in cameras:
        _, distortion, R, t = parts(c)
        if not world2cam:
            R, t = c.T_world_camera[:3, :3], c.center_world
        padded = np.zeros((4, 4))
        padded[:2, :3], padded[2, 3], padded[3, 2] = c.K[:2], 1, 1
        lens = dict(zip(("k1", "k2", "p1", "p2"), distortion, strict=True)) | dict.fromkeys(
            ("k3", "k4", "k5", "k6"), 0.0
        )
        values = {"class_name": "FisheyeCameraParameter", "convention": "opencv", "extrinsic_r": R, "extrinsic_t": t}
        values |= {"height": c.height, "width": c.width, "intrinsic": padded, "name": c.name, "world2cam": world2cam}
        to_json(folder / f"fisheye_param_{c.name}.json", values | lens)
    return folder


def voxelpose(folder, cameras):
    rows = {}
    for c in cameras:
        K, distortion, R, _ = parts(c)
        rows[c.name] = {"R": R, "T": 1000 * c.center_world[:, None], "fx": K[0, 0], "fy": K[1, 1], "cx": K[0, 2]}
        k, p = [*distortion[:2], 0.0], distortion[2:4]
        rows[c.name] |= {"cy": K[1, 2], "k": np.array(k)[:, None], "p": np.array(p)[:, None]}
    return to_json(folder / "calibration_shelf.json", rows)


def google(folder, cameras):
    rows = [
        {"name": c.name, "focal_length": c.K[0, 0], "principal_point": c.K[:2, 2], "pixel_aspect_ratio": 1.0,
         "radial_distortion": [*c.distortion[:2], 0.0], "tangential_distortion": c.distortion[2:], "width": c.width,
         "height": c.height, "projection_type": "perspective", "orientation": rigid.so3_log(parts(c)[2]),
         "position": c.center_world}
        for c in cameras
    ]  # fmt: skip
    return to_json(folder / "models.json", rows)


def calib_io(folder, cameras):
    rows = []
    for i, c in enumerate(cameras):
        K, distortion, R, t = parts(c)
        lens = {"f": K[0, 0], "ar": 1.0, "cx": K[0, 2], "cy": K[1, 2]}
        lens |= dict(zip(("k1", "k2", "p1", "p2"), distortion, strict=True))
        lens |= dict.fromkeys(("k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tauX", "tauY"), 0.0)
        size = {"CameraModelBase": {"imageSize": {"width": c.width, "height": c.height}}}
        data = {"parameters": {key: {"val": value, "state": 2} for key, value in lens.items()}, "CameraModelCRT": size}
        first = {"polymorphic_id": 2**31 + 1, "polymorphic_name": "libCalib::CameraModelOpenCV"}
        model = (first if i == 0 else {"polymorphic_id": 1}) | {"ptr_wrapper": {"valid": 1, "data": data}}
        turn = dict(zip(("rx", "ry", "rz"), rigid.so3_log(R), strict=True))
        rows.append({"model": model, "transform": {"rotation": turn, "translation": dict(zip("xyz", t, strict=True))}})
    return to_json(folder / "calib.json", {"Calibration": {"cameras": rows, "poses": []}})


def mvhumannet(folder, cameras, scale=120 / 65):
    (folder / "camera_scale.pkl").write_bytes(pickle.dumps(scale))
    rows = {
        f"1_{c.name}.png": {"rotation": parts(c)[2], "translation": 1000 * parts(c)[3] / scale,
                            "focal_length": np.diag(c.K)[:2], "image_center": [*c.K[:2, 2], *c.size]}
        for c in cameras
    }  # fmt: skip
    return to_json(folder / "camera_extrinsics.json", rows)


def wildtrack(folder, cameras):
    for c in cameras:
        K, distortion, R, t = parts(c)
        to_storage(folder / f"intr_{c.name}.xml", {"camera_matrix": K, "distortion_coefficients": distortion[:, None]})
        turn, shift = words(rigid.so3_log(R)), words(100 * t)
        rows = ['<?xml version="1.0"?>', "<opencv_storage>", f"<rvec>{turn}</rvec>", f"<tvec>{shift}</tvec>"]
        lines(folder / f"extr_{c.name}.xml", [*rows, "</opencv_storage>"])
    return folder


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
    "Skeletool: MPI-INF-3DHP, DynaCap, Captury (`camera.calibration`)": skeletool,
    "MayaCam 2 of XMALab and Autoscoper (one file for each camera)": mayacam2,
    "MayaCam 1 (one file for each camera)": mayacam1,
    "DLT coefficients of DLTdv, Argus and easyWand (`dltCoefs.csv`)": dlt,
    "COLMAP (`cameras.txt` and `images.txt`)": colmap,
    "Ego-Exo4D (`gopro_calibs.csv`)": egoexo,
    "XRMoCap, XRPrimer (one file for each camera)": xrmocap,
    "VoxelPose: Shelf, Campus": voxelpose,
    "Google's light fields (`models.json`), Nerfies": google,
    "calib.io": calib_io,
    "MVHumanNet (`camera_extrinsics.json`, with `camera_scale.pkl` beside it)": mvhumannet,
    "Wildtrack (`intr_NAME.xml` and `extr_NAME.xml`)": wildtrack,
    "OpenCV's words in JSON, YAML or XML": opencv_words,
}
"""Writers by the names of the layouts."""
WITHOUT_LENS = (vicon, skeletool, mayacam2, mayacam1, dlt, mvhumannet)
"""Writers of layouts whose lenses have no distortion that is read."""


def rig_for(write, rig):
    """Return a rig as a layout can hold it: without distortion, or with fisheye lenses."""
    if write in WITHOUT_LENS:
        return [replace(c, distortion=np.zeros(0)) for c in rig]
    return [replace(c, fisheye=True) for c in rig] if write is egoexo else rig
