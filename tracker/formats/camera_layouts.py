"""Rewrite cameras of common layouts to sections of the anipose layout.

A layout is read where its keys fix the convention: OpenCV's names (K, R, t, rvec, ...), which mean
`X_camera = R X_world + t` and OpenCV's order of distortion; EasyMocap; CMU Panoptic; Kalibr. Poses map world to camera;
camera-to-world poses are not read.
"""

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np

from tracker.formats.camera_section import Units

Section: TypeAlias = dict[str, Any]

_KEYS = {
    "matrix": "matrix k cameramatrix cammatrix intrinsic intrinsics intrinsicmatrix intrinsicsmatrix mtx",
    "distortions": "distortions distortion dist distcoef distcoefs distcoeff distcoeffs d "
    "distortioncoefficients distortioncoeffs distortionvector",
    "matrix_R": "rotation r rot rotationmatrix rmat",
    "rodrigues": "rvec rotationvector rodrigues",
    "translation": "translation t tvec translationvector",
    "T_camera_world": "rt extrinsic extrinsics extrinsicmatrix extrinsicsmatrix worldtocamera world2cam w2c "
    "tcameraworld",
    "size": "size resolution imagesize imgsize",
    "width": "width w imagewidth imgwidth",
    "height": "height h imageheight imgheight",
    "name": "name cameraname label",
    "number": "id camid cameraid serial serialnumber",
    "lens": "fisheye cameramodel distortionmodel",
}
_MEANING = {alias: meaning for meaning, aliases in _KEYS.items() for alias in aliases.split()}
_FISHEYE = ("fisheye", "equidistant", "equi", "kannala", "omni", "mei", "fov", "division")
_SHORTER = {14: 12, 12: 8, 8: 5}
_LISTS = ("cameras", "cams", "camera")
"""Keys under which the cameras of a file may lie."""


def camera_sections(data: Any) -> tuple[dict[str, Section], Units | None]:
    """Return the sections of all cameras by name, and the unit of lengths if the layout fixes it.

    Args:
        data: plain data of a JSON, YAML or XML file.

    Returns:
        Sections whose missing values are None; empty if the data has no camera of a known layout.
    """
    if isinstance(data, Mapping) and any(_is_kalibr(value) for value in data.values()):
        return _kalibr(data), "m"
    groups = _groups(data)
    panoptic = isinstance(data, Mapping) and "calibDataSource" in data
    sections: dict[str, Section] = {}
    for key, group in groups.items():
        section = _section(_known(group))
        name = key if section["name"] is None else str(section["name"])
        sections[name if name not in sections else f"{name} ({key})"] = section | {"name": name}
    return sections, "cm" if panoptic else None


def _groups(data: Any) -> dict[str, Mapping[str, Any]]:
    """Return the keys and values of each camera, by the key or index that it has."""
    if isinstance(data, list):
        rows = [item for item in data if isinstance(item, Mapping)]
        return {str(_known(row).get("number", i)): row for i, row in enumerate(rows)}
    if not isinstance(data, Mapping):
        return {}
    for key in _LISTS:
        if isinstance(data.get(key), Mapping | list):
            return _groups(data[key])
    if any(_MEANING.get(_spelled(key)) == "matrix" and not isinstance(v, Mapping) for key, v in data.items()):
        return {"camera": data}
    nested = {k: v for k, v in data.items() if isinstance(v, Mapping) and _is_camera(_known(v))}
    return nested or _by_suffix(data)


def _by_suffix(data: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Group flat keys such as `K_01`, `dist_01`, `Rot_01` by what follows the underscore."""
    found: dict[str, dict[str, Any]] = {}
    for key, value in data.items():
        parts = key.split("_")
        for i in range(1, len(parts)):
            meaning = _MEANING.get("".join(parts[:i]).lower())
            if meaning not in (None, "name", "number"):
                found.setdefault("_".join(parts[i:]), {})["_".join(parts[:i])] = value
                break
    return {name: group for name, group in found.items() if _is_camera(_known(group)) or "translation" in _known(group)}


def _known(group: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of one camera by their meaning; keys of groups inside are lifted."""
    found: dict[str, Any] = {}
    for key, value in group.items():
        plain = _spelled(key)
        if isinstance(value, Mapping) and plain not in _KEYS["size"].split():
            found |= {k: v for k, v in _known(value).items() if k not in found}
        elif plain in ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "p1", "p2"):
            found[plain] = value
        elif (meaning := _MEANING.get(plain)) is not None:
            # EasyMocap has both a vector R and a matrix Rot, which are equal.
            if meaning == "matrix_R" and np.size(_plain(value)) == 3:
                meaning = "rodrigues"
            found[meaning] = value
    return found


def _is_camera(known: Mapping[str, Any]) -> bool:
    return "matrix" in known or "fx" in known


def _spelled(key: str) -> str:
    """Return a key without case and separators."""
    return "".join(c for c in key.lower() if c.isalnum())


def _section(known: Mapping[str, Any]) -> Section:
    rotation = known.get("matrix_R", known.get("rodrigues"))
    translation = known.get("translation")
    whole = known.get("T_camera_world")
    if rotation is None and _shape(whole) in ((3, 4), (4, 4)):
        rotation, translation = _plain(whole)[:3, :3].tolist(), _plain(whole)[:3, 3].tolist()
    lens = known.get("lens")
    return {
        "name": known.get("name"),
        "size": _size(known),
        "matrix": _matrix(known),
        "distortions": _distortions(known),
        "rotation": _reshaped(rotation, {3: (3,), 9: (3, 3)}),
        "translation": _reshaped(translation, {3: (3,)}),
        "fisheye": lens is True or (isinstance(lens, str) and any(word in lens.lower() for word in _FISHEYE)),
    }


def _matrix(known: Mapping[str, Any]) -> Any:
    matrix = known.get("matrix")
    if matrix is None and {"fx", "fy", "cx", "cy"} <= known.keys():
        matrix = [known[k] for k in ("fx", "fy", "cx", "cy")]
    if _shape(matrix) == (4,):  # as Kalibr writes it
        fx, fy, cx, cy = _plain(matrix).tolist()
        return [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]
    return _reshaped(matrix, {9: (3, 3)})


def _distortions(known: Mapping[str, Any]) -> Any:
    found = known.get("distortions")
    if found is None:
        found = [known.get(k, 0.0) for k in ("k1", "k2", "p1", "p2", "k3")] if "k1" in known else []
    flat = _reshaped(found, {n: (n,) for n in (4, 5, 8, 12, 14)})
    # OpenCV writes 12 or 14 values; those of thin prisms and tilted sensors are usually 0.
    while isinstance(flat, list) and len(flat) in (14, 12, 8) and not any(flat[_SHORTER[len(flat)] :]):
        flat = flat[: _SHORTER[len(flat)]]
    return flat


def _size(known: Mapping[str, Any]) -> Any:
    size = known.get("size")
    if isinstance(size, Mapping):
        known, size = _known(size), None
    return [known["width"], known["height"]] if size is None and {"width", "height"} <= known.keys() else size


def _reshaped(value: Any, shapes: Mapping[int, tuple[int, ...]]) -> Any:
    """Give numbers the shape that belongs to their count; other data is returned as it is, to be refused by name."""
    array = _plain(value)
    return value if array.size not in shapes else array.reshape(shapes[array.size]).tolist()


def _plain(value: Any) -> Any:
    """Return an array of numbers; an empty one if it is none."""
    try:
        return np.array(value, dtype=np.float64)
    except (ValueError, TypeError, OverflowError):
        return np.zeros(0)


def _shape(value: Any) -> tuple[int, ...]:
    return () if value is None else tuple(_plain(value).shape)


# --- Kalibr ---------------------------------------------------------------------------------------------------------


def _is_kalibr(value: Any) -> bool:
    return isinstance(value, Mapping) and "camera_model" in value and "intrinsics" in value


def _kalibr(data: Mapping[str, Any]) -> dict[str, Section]:
    """Rewrite a camchain: each camera's `T_cn_cnm1` maps the camera before to it; the first defines the world."""
    found: dict[str, Section] = {}
    T_camera_world = np.eye(4)
    chain = {name: camera for name, camera in data.items() if _is_kalibr(camera)}
    for i, (name, camera) in enumerate(chain.items()):
        section = _section(_known(camera))
        step = _plain(camera.get("T_cn_cnm1"))
        if i and step.shape == (4, 4):
            T_camera_world = step @ T_camera_world
        if not i or step.shape == (4, 4):
            section |= {"rotation": T_camera_world[:3, :3].tolist(), "translation": T_camera_world[:3, 3].tolist()}
        section["fisheye"] |= camera["camera_model"] != "pinhole"
        found[name] = section | {"name": name}
    return found
