"""Rewrite the cameras of common layouts to sections of the anipose layout, by the words that their keys are.

OpenCV's words (K, R, t, rvec, ...) mean `X_camera = R X_world + t` and OpenCV's order of distortion. Keys that may
change the meaning and are not understood are refused by name, never left out.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from tracker.errors import CalibrationError
from tracker.formats.anipose import FOUR_DIGITS
from tracker.formats.calibrations import camera_matrices as matrices
from tracker.formats.calibrations.document import Document, refuse
from tracker.formats.calibrations.lens_words import (
    FISHEYE,
    LISTS,
    MEANINGS,
    UnknownLensError,
    is_fisheye,
    is_known,
    is_of,
    is_understood,
    is_unknown,
    names_lens,
    spelled,
)
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.lengths import USUAL_SIZES
from tracker.validation import quoted

Section: TypeAlias = dict[str, Any]
"""One camera: name, size, matrix, distortions, rotation, translation, fisheye; what is missing is None."""

COEFFICIENTS = {False: ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"), True: ("k1", "k2", "k3", "k4")}
"""OpenCV's order of the coefficients of a usual lens, and of a fisheye."""
_POSE = {"matrix_R", "rodrigues", "quaternion", "qw", "translation", "tx", "T_camera_world", "T_world_camera"}
"""Meanings that belong to a pose."""
_FORMS = {3: "rodrigues", 4: "quaternion"}
"""Meanings of a rotation by the count of its numbers, where that is not 9: EasyMocap has both a vector R and a matrix
Rot, which are equal."""
_COUNTS = (5, 8, 12, 14)
"""Counts of OpenCV's coefficients."""
_SHORTER = dict(zip(_COUNTS[1:], _COUNTS, strict=False))
"""By count, to how many they are cut where the others are 0."""
_REWRITE = "rewrite the camera to K, distortion, R and t of OpenCV's model, or remove the key if it says nothing"


def camera_groups(data: Any) -> dict[str, Mapping[str, Any]]:
    """Return the keys and values of each camera by its key or index; empty where there is no camera."""
    if isinstance(data, list):
        rows = [item for item in data if isinstance(item, Mapping)]
        return {plain_text(known_values(row).get("number", i)): row for i, row in enumerate(rows) if is_camera(row)}
    if not isinstance(data, Mapping):
        return {}
    for key in LISTS:
        if isinstance(data.get(key), Mapping | list) and (found := camera_groups(data[key])):
            return _with_poses(found, {k: v for k, v in data.items() if k != key})
    if is_camera({key: value for key, value in data.items() if not isinstance(value, Mapping)}):
        return {"": data}
    for key, value in data.items():
        if isinstance(value, Mapping | list) and _holds_cameras(value):
            return _with_poses(camera_groups(value), {k: v for k, v in data.items() if k != key})
    nested = {k: v for k, v in data.items() if isinstance(v, Mapping) and is_camera(v)}
    return nested or _by_suffix(data)


def _holds_cameras(group: Mapping[str, Any] | list[Any]) -> bool:
    """Return whether a group is none of a camera, but of several, or of the list of them."""
    if isinstance(group, list):
        return any(isinstance(row, Mapping) and is_camera(row) for row in group)
    inner = [v for v in group.values() if isinstance(v, Mapping) and is_camera(v)]
    return len(inner) > 1 or any(_holds_cameras(group[k]) for k in LISTS if isinstance(group.get(k), Mapping | list))


def _with_poses(cameras: dict[str, Mapping[str, Any]], others: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Add the poses of cameras that lie in a group beside them, under the same names, where only one group has them."""
    groups = [group for group in others.values() if isinstance(group, Mapping) and cameras.keys() <= group.keys()]
    groups = [g for g in groups if all(isinstance(g[name], Mapping) and has_pose(g[name]) for name in cameras)]
    if len(groups) != 1 or any(has_pose(camera) for camera in cameras.values()):
        return cameras
    return {name: {**groups[0][name], **camera} for name, camera in cameras.items()}


def has_pose(group: Mapping[str, Any]) -> bool:
    """Return whether a group has words of a pose."""
    return bool(_POSE & known_values(group).keys())


def _by_suffix(data: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Group flat keys such as `K_01`, `dist_01`, `Rot_01` by what follows the underscore."""
    found: dict[str, dict[str, Any]] = {}
    for key, value in data.items():
        parts = key.split("_")
        for i in range(1, len(parts)):
            meaning = MEANINGS.get("".join(parts[:i]).lower())
            if meaning not in (None, "name", "number", "ignore"):
                found.setdefault("_".join(parts[i:]), {})["_".join(parts[:i])] = value
                break
    return {name: group for name, group in found.items() if is_camera(group) or "translation" in known_values(group)}


def is_camera(group: Mapping[str, Any]) -> bool:
    """Return whether a group has the lens of a camera, or its projection."""
    known = known_values(group)
    return bool({"matrix", "fx", "focal"} & known.keys()) or matrices.is_projection(known.get("projection"))


def known_values(group: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of one camera by their meaning, without empty ones; keys of groups inside are lifted."""
    found: dict[str, Any] = {}
    for key, value in _flat(group):
        plain = spelled(key)
        if is_absent(value):
            continue
        if is_of("numbers", plain):
            found[plain] = value
        elif (meaning := MEANINGS.get(plain)) is not None:
            if meaning == "matrix_R":
                meaning = _FORMS.get(matrices.plain_array(value).size, meaning)
            found[meaning] = value
    return found


def _flat(group: Mapping[str, Any], depth: int = 0) -> Iterator[tuple[str, Any]]:
    """Yield keys and values of a group; those of groups inside come first, so that outer ones replace them."""
    inner = {k: v for k, v in group.items() if isinstance(v, Mapping) and MEANINGS.get(spelled(k)) != "size"}
    if depth < 4:
        for key, value in inner.items():
            found = list(_flat(value, depth + 1))
            # A group of coefficients may say the model by its name alone.
            has_lens = any(spelled(k) == "k1" or MEANINGS.get(spelled(k)) == "distortions" for k, _ in found)
            if has_lens and is_of("fisheye", key):
                yield key, FISHEYE
            yield from found
    yield from ((str(k), v) for k, v in group.items() if k not in inner)


def unusable(name: str, reason: str = "") -> Section:
    """Return a camera that has nothing, or that cannot be used for a reason, a sentence without its end."""
    keys = ("size", "matrix", "distortions", "rotation", "translation")
    return {"name": name, "fisheye": False} | dict.fromkeys(keys) | ({"refusal": reason} if reason else {})


def posed(T_camera_world: Array | None) -> Section:
    """Return the pose of a camera, (4, 4), as plain data; None for none."""
    if T_camera_world is None:
        return {"rotation": None, "translation": None}
    return {"rotation": T_camera_world[:3, :3].tolist(), "translation": T_camera_world[:3, 3].tolist()}


def plain_camera(
    name: str | None, size: Sequence[float] | None, K: Any, lens: Sequence[float], T: Array, fisheye: bool = False
) -> Section:
    """Return a camera with the coefficients of its lens and its pose from world to camera, (4, 4)."""
    words = {"matrix": np.asarray(K).tolist(), "distortions": list(lens), "fisheye": fisheye}
    return {"name": name, "size": size} | words | posed(T)


def unit_rotation(document: Document, camera: str, key: str, wxyz: Sequence[float] | Array) -> Array:
    """Return the rotation, (3, 3), of a quaternion.

    Raises:
        CalibrationError: its length is not 1.
    """
    if (R := matrices.rotation_of_quaternion(wxyz)) is None:
        found = f"a norm of {np.linalg.norm(wxyz):.3g}"
        raise refuse(document, camera, f"a unit quaternion as {key}", found, "export the file again")
    return R


def each(camera: Callable[[Document, str, Mapping[str, Any]], Section]) -> Callable[[Document], dict[str, Section]]:
    """Return the reader of all cameras of a file, from that of one, whose name is that of the file if it has none."""

    def read(document: Document) -> dict[str, Section]:
        found = ((name, camera(document, name or document.stem, row)) for name, row in document.rows)
        return once(document, ((name, section | {"name": name or None}) for name, section in found))

    return read


def once(document: Document, cameras: Iterable[tuple[str, Section]]) -> dict[str, Section]:
    """Return cameras by name.

    Raises:
        CalibrationError: a name is there twice.
    """
    found: dict[str, Section] = {}
    for name, section in cameras:
        if name in found:
            raise CalibrationError(f"{document.where}: two cameras are named {quoted(name)}; give each its own name")
        found[name] = section
    return found


def plain_text(value: Any) -> str:
    """Return text as it is, and a short form of anything else."""
    return value if isinstance(value, str) else quoted(value)


def is_absent(value: Any) -> bool:
    """Return whether a value stands for none, as `null` in JSON, its word in TOML, and lists of NaN do."""
    if isinstance(value, list):
        return all(map(is_absent, value))
    is_word = isinstance(value, str) and value.strip().lower() in ("", "null", "none", "nan")
    return value is None or is_word or (isinstance(value, float) and np.isnan(value))


def section_of(group: Mapping[str, Any], camera: str, document: Document) -> Section:
    """Rewrite one camera.

    Args:
        group: its keys and values.
        camera: its name, for messages.
        document: the file, for messages.

    Raises:
        CalibrationError: a key or value that changes the meaning is not understood, or half of the pose is missing.
    """
    known = known_values(group)
    _refuse_unknown(_flat(group), camera, document)
    words = _words_of_file(document)
    words |= {key: value for key, value in _flat(group) if names_lens(key, value)}
    try:
        fisheye = is_fisheye(words)
    except UnknownLensError as error:
        raise CalibrationError(f"{document.where}, camera {quoted(camera)}: {error}") from error
    if not fisheye and "k4" in known and not {"distortions", "p1", "p2", "k5", "k6"} & known.keys():
        found = "k1 to k4 alone, which are a fisheye's"
        raise refuse(document, camera, "k1, k2, p1 and p2 of a lens", found, "say `fisheye: true`, or add p1 and p2")
    matrix = matrices.lens_matrix(known)
    if "projection" in known and not _POSE & known.keys():
        matrix, pose = _split(known, matrix, camera, document)
        known |= {} if pose is None else {"T_camera_world": pose}
    rotation, translation = _pose(known, group, camera, document)
    _check_focal(matrix, camera, document)
    distortions = _distortions(known, fisheye)
    if not fisheye and isinstance(distortions, list) and len(distortions) in (12, 14):
        advice = "undistort the footage, or calibrate without this model"
        raise refuse(document, camera, "up to 8 coefficients", "those of a thin prism or a tilted sensor", advice)
    return {
        "name": known.get("name"),
        "size": _size(known),
        "matrix": matrix,
        "distortions": distortions,
        "rotation": rotation,
        "translation": translation,
        "fisheye": fisheye,
        "unit": _stated_unit(_flat(group)) or _stated_unit(_said_of_all(document).items()),
    }


def _stated_unit(values: Iterable[tuple[str, Any]]) -> str | None:
    """Return the word for the unit of the translations; None if there is none."""
    words = [v.strip().lower() for k, v in values if is_of("units", k) and isinstance(v, str)]
    return next((word for word in words if word and not is_of("other_units", word)), None)


def _said_of_all(document: Document) -> dict[str, Any]:
    """Return the values at the top of a file and in its metadata, which hold for all its cameras."""
    if not isinstance(document.data, Mapping):
        return {}
    notes = {k: v for key, group in document.groups.items() if is_of("notes", key) for k, v in _flat(group)}
    return notes | {key: value for key, value in document.data.items() if not isinstance(value, Mapping | list)}


def _words_of_file(document: Document) -> dict[str, Any]:
    """Return what a file says of the lens for all its cameras, at its top or in its metadata.

    Raises:
        CalibrationError: a key at its top may change the meaning and is not understood.
    """
    said = _said_of_all(document)
    # Metadata has remarks of any kind.
    _refuse_unknown(((k, v) for k, v in said.items() if k in document.data), None, document)
    return {key: value for key, value in said.items() if is_understood(key, value)}


def _refuse_unknown(values: Iterable[tuple[str, Any]], camera: str | None, document: Document) -> None:
    """Refuse keys and values that may change the meaning of the others, and are not understood.

    Raises:
        CalibrationError: there is one.
    """
    for key, value in values:
        if not (is_known(key) or names_lens(key, value) or is_absent(value)) and is_unknown(key, value):
            found = f"{quoted(key)} = {quoted(value)}" if isinstance(value, str) else quoted(key)
            raise refuse(document, camera, "known keys of a lens or a convention", found, _REWRITE)


def _split(known: Mapping[str, Any], matrix: Any, camera: str, document: Document) -> tuple[Any, Any]:
    """Return the matrix of the lens and the pose of a projection; the pose is None where the lens is another's.

    Raises:
        CalibrationError: it is the projection of no usable camera.
    """
    if not matrices.is_projection(known["projection"]):
        return matrix, None
    try:
        K, T_camera_world = matrices.split_projection(known["projection"])
    except matrices.ProjectionError as error:
        place, advice = f"{document.where}, camera {quoted(camera)}", "give K, R and t of the camera instead"
        raise CalibrationError(f"{place}: {error}; {advice}") from error
    four_digits = {"rtol": FOUR_DIGITS, "atol": FOUR_DIGITS * K[0, 0]}
    if matrix is not None and not np.allclose(matrices.plain_array(matrix), K, **four_digits):
        return matrix, None  # that of rectified pictures, as ROS writes it
    return (K.tolist() if matrix is None else matrix), T_camera_world


def _check_focal(matrix: Any, camera: str, document: Document) -> None:
    """Check that a focal length is in pixels.

    Raises:
        CalibrationError: no lens has so short a one.
    """
    K = matrices.plain_array(matrix)
    # The principal point lies near the middle; of pictures that are cut at a side it is up to twice as far.
    if K.shape == (3, 3) and 0 < K[0, 0] < USUAL_SIZES["focal length"].low * K[0, 2]:
        found = f"{K[0, 0]:.4g} of pictures that are some {2 * K[0, 2]:.0f} pixels wide, as in millimetres"
        advice = "multiply it by the width of the pictures over that of the sensor"
        raise refuse(document, camera, "a focal length in pixels", found, advice)


def _pose(known: Mapping[str, Any], group: Mapping[str, Any], camera: str, document: Document) -> tuple[Any, Any]:
    """Return rotation and translation; None and None of a camera without a pose.

    Raises:
        CalibrationError: only one of them is there, or the pose lies under words whose meaning is not fixed.
    """
    rotation = next((known[key] for key in ("matrix_R", "rodrigues", "quaternion") if key in known), None)
    if rotation is None:
        named = matrices.rotation_of_quaternion([known.get(key) for key in ("qw", "qx", "qy", "qz")])
        rotation = None if named is None else named.tolist()
    translation = known.get("translation")
    if translation is None and {"tx", "ty", "tz"} <= known.keys():
        translation = [known[key] for key in ("tx", "ty", "tz")]
    if rotation is None and translation is None:
        for key in ("T_camera_world", "T_world_camera"):
            if (whole := matrices.homogeneous(known.get(key))) is not None:
                whole = whole if key == "T_camera_world" else rigid.inverse(whole)
                return whole[:3, :3].tolist(), whole[:3, 3].tolist()
    if rotation is None or translation is None:
        others = [key for key, value in _flat(group) if is_of("other_poses", key) and not is_absent(value)]
        whole_key = next((key for key in ("T_camera_world", "T_world_camera") if key in known), None)
        if rotation is not None or translation is not None or others or whole_key:
            has = ["the rotation"] * (rotation is not None) + ["the translation"] * (translation is not None)
            has += [quoted(key) for key in others] + ["a matrix that is no pose"] * (whole_key is not None)
            expected = "its pose as R and t (X_camera = R X_world + t)"
            raise refuse(document, camera, expected, f"{', '.join(has)} alone", "rewrite the pose to R and t")
        return None, None
    return matrices.reshaped(rotation, {3: (3,), 4: (4,), 9: (3, 3)}), matrices.reshaped(translation, {3: (3,)})


def _distortions(known: Mapping[str, Any], fisheye: bool) -> Any:
    found = known.get("distortions")
    if found is None and "radial" in known:
        parts = (known["radial"], known.get("tangential", [0, 0]))
        radial, tangential = (matrices.plain_array(part).ravel() for part in parts)
        found = [*radial[:2], *tangential, *radial[2:]]
    if found is None:
        found = [known.get(k, 0.0) for k in COEFFICIENTS[fisheye]] if "k1" in known else []
    flat = matrices.reshaped(found, {n: (n,) for n in range(1, 15)})
    # OpenCV writes 12 or 14 values; those of thin prisms and tilted sensors are usually 0.
    while not fisheye and isinstance(flat, list) and len(flat) in _SHORTER and not any(flat[_SHORTER[len(flat)] :]):
        flat = flat[: _SHORTER[len(flat)]]
    return flat


def _size(known: Mapping[str, Any]) -> Any:
    size = known.get("size")
    if isinstance(size, Mapping):
        known, size = known_values(size), None
    if size is None:
        return [known["width"], known["height"]] if {"width", "height"} <= known.keys() else None
    return matrices.reshaped(size, {2: (2,)})
