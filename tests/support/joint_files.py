"""Tables, JSON and arrays of joints in space, as the programs write them that the library reads."""

import json
import struct

import numpy as np

KINDS = {
    "wide": "a.csv",
    "people": "a.csv",
    "semicolon": "a.csv",
    "deeplabcut": "a.csv",
    "individuals": "a.csv",
    "anipose": "a.csv",
    "jarvis": "data3D.csv",
    "tidy": "a.csv",
    "caliscope": "xyz_POSE.csv",
    "nexus": "a.csv",
    "motive": "a.csv",
    "qtm": "a.tsv",
    "qtm with times": "a.tsv",
    "easymocap": "keypoints3d/000001.json",
    "panoptic": "hd/body3DScene_00000001.json",
    "c3d": "a.c3d",
    "npy": "a.npy",
    "npz": "a.npz",
}
"""A file of each kind, by its name."""
NUMBERED = ("caliscope", "easymocap", "npy", "npz")
"""Kinds whose points have no names."""
OF_PEOPLE = ("people", "c3d", "individuals", "easymocap", "panoptic", "npy")
"""Kinds with several people in one file."""
IN_MM = ("wide", "c3d", "nexus", "qtm", "qtm with times")
IN_CM = ("panoptic",)


def write_joints(kind, folder, names, points, rate=30.0):
    """Write points of people, metres, (n_people, n, n_points, 3); of one person unless the kind has several.

    Returns:
        The file or folder to import.
    """
    path = folder / KINDS[kind]
    path.parent.mkdir(parents=True, exist_ok=True)
    points = points * (1000 if kind in IN_MM else 100 if kind in IN_CM else 1)
    if kind in ("easymocap", "panoptic"):
        _write_scenes(kind, path, points)
        return path.parent
    if kind == "c3d":
        path.write_bytes(_c3d([f"{who}:{n}" for who in ("Ann", "Ben")[: len(points)] for n in names], points, rate))
        return path
    if kind in ("npy", "npz"):
        of_frames = np.swapaxes(points, 0, 1)
        if kind == "npy":
            np.save(path, of_frames.astype(np.float32))
        else:
            np.savez_compressed(path, joints=of_frames[:, 0], betas=np.zeros(10), poses=np.zeros((len(of_frames), 72)))
        return path
    path.write_text("\n".join(_LINES[kind](list(names), points, rate)) + "\n")
    return path


def _write_scenes(kind, path, points):
    for k in range(points.shape[1]):
        sure = np.where(np.isfinite(points[:, k]).all(axis=-1), 0.9, -1.0)
        rows = np.concatenate([np.nan_to_num(points[:, k]), sure[..., None]], axis=-1).round(6)
        if kind == "easymocap":
            data = [{"id": i, "keypoints3d": person.tolist()} for i, person in enumerate(rows)]
        else:
            data = {"version": 0.7, "bodies": [{"id": i, "joints19": p.ravel().tolist()} for i, p in enumerate(rows)]}
        name = path.name.replace("00001.json", f"{k:05d}.json")
        path.with_name(name).write_text(json.dumps(data))


def _c3d(labels, points, rate):
    """Real numbers of Intel, in mm; a point that is missing has the residual -1."""

    def parameter(group, name, dims, data):
        body = struct.pack(f"<bB{len(dims)}B", -1, len(dims), *dims) + data + b"\0"
        return struct.pack("bb", len(name), group) + name.encode() + struct.pack("<H", 2 + len(body)) + body

    width = max(map(len, labels))
    text = "".join(label.ljust(width) for label in labels).encode()
    parameters = b"\1\x50\x08\x54" + struct.pack("bb", 5, -1) + b"POINT" + struct.pack("<HB", 3, 0)
    parameters += parameter(1, "LABELS", (width, len(labels)), text) + parameter(1, "UNITS", (2,), b"mm") + bytes(2)
    blocks = -(-len(parameters) // 512)
    n_frames = points.shape[1]
    head = struct.pack("<BB5HfHHf", 2, 0x50, len(labels), 0, 1, n_frames, 10, -1.0, 2 + blocks, 0, rate)
    rows = np.concatenate([points, np.where(np.isnan(points[..., :1]), -1.0, 0.0)], axis=-1)
    data = np.nan_to_num(np.swapaxes(rows, 0, 1)).astype("<f4").tobytes()
    return head.ljust(512, b"\0") + parameters.ljust(512 * blocks, b"\0") + data


def _text(values):
    return ["" if np.isnan(x) else f"{x:.6f}" for x in np.ravel(values)]


def _wide(names, points, rate):
    yield ",".join(["frame", "time_s", *(f"{n}.{a}_mm" for n in names for a in "xyz")])
    for k, row in enumerate(points[0]):
        yield ",".join([str(k), f"{k / rate:.6f}", *_text(row)])


def _people(names, points, rate):
    yield ",".join(["person", "frame", "time_s", "status", *(f"{n}.{a}_m" for n in names for a in ("x", "y", "z"))])
    for person, motion in zip(("ann", "ben"), points, strict=False):
        yield from (",".join([person, str(k), f"{k / rate:.6f}", "good", *_text(row)]) for k, row in enumerate(motion))


def _semicolon(names, points, rate):
    yield ";".join(["\ufefffr", *(f'"{n}_{a}"' for n in names for a in "xyz")]).replace("fr", "frame")
    yield from (";".join([str(k), *(c.replace(".", ",") for c in _text(row))]) for k, row in enumerate(points[0]))


def _deeplabcut(names, points, rate):
    columns = [(n, a) for n in names for a in ("x", "y", "z", "z_var")]
    yield ",".join(["scorer", *("EKS" for _ in columns)])
    yield ",".join(["bodyparts", *(n for n, _ in columns)])
    yield ",".join(["coords", *(a for _, a in columns)])
    for k, row in enumerate(points[0]):
        yield ",".join([str(k), *(cell for point in row for cell in (*_text(point), "0.1"))])


def _individuals(names, points, rate):
    columns = [(i, n, a) for i in ("ann", "ben")[: len(points)] for n in names for a in "xyz"]
    yield ",".join(["scorer", *("DLC_3D" for _ in columns)])
    for label, cells in zip(("individuals", "bodyparts", "coords"), zip(*columns, strict=True), strict=True):
        yield ",".join([label, *cells])
    yield from (",".join([str(k), *_text(points[:, k])]) for k in range(points.shape[1]))


def _anipose(names, points, rate):
    columns = [f"{n}_{what}" for n in names for what in ("x", "y", "z", "error", "ncams", "score")]
    yield ",".join([*columns, "M_00", "M_01", "center_0", "fnum"])
    for k, row in enumerate(points[0]):
        cells = [cell for point in row for cell in (*_text(point), "1.5", "3", "0.9")]
        yield ",".join([*cells, "1", "0", "0.5", str(k)])


def _jarvis(names, points, rate):
    yield ",".join(n for n in names for _ in range(4))
    yield ",".join(["x,y,z,confidence"] * len(names))
    for row in points[0]:
        yield ",".join(cell or "NaN" for point in row for cell in (*_text(point), "0.9"))


def _tidy(names, points, rate):
    yield "frame,timestamp,model,keypoint,x,y,z,reprojection_error"
    for k, row in enumerate(points[0]):
        found = [(n, p) for n, p in zip(names, row, strict=True) if np.isfinite(p).all()]
        yield from (f"{k},,body,{n},{','.join(_text(p))},1.2" for n, p in found)


def _caliscope(names, points, rate):
    yield "sync_index,point_id,x_coord,y_coord,z_coord,frame_time"
    for k, row in enumerate(points[0]):
        found = [(i, p) for i, p in enumerate(row) if np.isfinite(p).all()]
        yield from (f"{k},{i},{','.join(_text(p))},{1000 + k / rate:.4f}" for i, p in found)


def _nexus(names, points, rate):
    yield from ("Trajectories", f"{rate:g}", ",," + ",,,".join(f"Ann:{n}" for n in names) + ",,")
    yield ",".join(["Frame", "Sub Frame", *(a for _ in names for a in "XYZ")])
    yield ",".join(["", "", *("mm" for _ in names for _ in "XYZ")])
    yield from (",".join([str(k + 1), "0", *_text(row)]).rstrip(",") for k, row in enumerate(points[0]))
    yield from ("", "Devices", "1000", "Frame,Sub Frame,Fx", "1,0,3.5")


def _motive(names, points, rate):
    yield f"Format Version,1.23,Take Name,walk,Export Frame Rate,{rate:.6f},Length Units,Meters,Coordinate Space,Global"
    columns = [("Rigid Body", "wand", "Rotation", a) for a in "XYZW"] + [("Marker", "Unlabeled 1", "Position", "X")]
    columns += [("Marker", f"Ann:{n}", "Position", a) for n in names for a in "XYZ"]
    kinds, labels, what, axes = zip(*columns, strict=True)
    yield ""
    yield from (",".join(["", "", *row]) for row in (kinds, labels, ['"1"'] * len(axes), what))
    yield ",".join(["Frame", "Time (Seconds)", *axes])
    for k, row in enumerate(points[0]):
        yield ",".join([str(k), f"{k / rate:.6f}", *["0.5"] * 5, *_text(row)])


def _qtm(names, points, rate, has_times=False):
    yield f"NO_OF_FRAMES\t{points.shape[1]}\nNO_OF_MARKERS\t{len(names)}\nFREQUENCY\t{rate:g}\nDESCRIPTION\t--"
    yield "TIME_STAMP\t2026-01-01, 10:00:00.000\t123.4\nDATA_INCLUDED\t3D"
    yield "\t".join(["MARKER_NAMES", *names])
    if has_times:
        yield "\t".join(["Frame", "Time", *(f"{n} {a}" for n in names for a in "XYZ")])
    for k, row in enumerate(points[0]):
        yield "\t".join([*([str(k + 1), f"{k / rate:.5f}"] if has_times else []), *_text(row)])


_LINES = {
    "wide": _wide,
    "people": _people,
    "semicolon": _semicolon,
    "deeplabcut": _deeplabcut,
    "individuals": _individuals,
    "anipose": _anipose,
    "jarvis": _jarvis,
    "tidy": _tidy,
    "caliscope": _caliscope,
    "nexus": _nexus,
    "motive": _motive,
    "qtm": _qtm,
    "qtm with times": lambda *given: _qtm(*given, has_times=True),
}
