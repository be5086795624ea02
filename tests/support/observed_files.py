"""Small files of key points and joints as other programs write them."""

import json
import pickle

import numpy as np


def write_deeplabcut(path, names, points, kind):
    """One camera, points (n, n_people, n_points, 3): `csv` of one animal, `multi` of several, `h5` as pandas does."""
    path.parent.mkdir(parents=True, exist_ok=True)
    individuals = [f"animal{i}" for i in range(points.shape[1])]
    heads = [("DLC", i, n, c) for i in individuals for n in names for c in ("x", "y", "likelihood")]
    if kind == "csv":
        heads = [(s, n, c) for s, _, n, c in heads]
    rows = points.reshape(len(points), -1)
    if kind == "h5":
        import h5py

        block = np.dtype([("index", "<i8"), ("values_block_0", "<f8", (rows.shape[1],))])
        table = np.zeros(len(rows), block)
        table["index"], table["values_block_0"] = np.arange(len(rows)), rows
        with h5py.File(path.with_name(path.name + ".h5"), "w") as file:
            group = file.create_group("df_with_missing")
            group.create_dataset("table", data=table)
            group.attrs["non_index_axes"] = np.bytes_(pickle.dumps([(1, heads)], protocol=0))
        return
    labels = ("scorer", "bodyparts", "coords") if kind == "csv" else ("scorer", "individuals", "bodyparts", "coords")
    lines = [",".join([label, *cells]) for label, cells in zip(labels, zip(*heads, strict=True), strict=True)]
    lines += [",".join([str(k), *("" if np.isnan(x) else f"{x:.6f}" for x in row)]) for k, row in enumerate(rows)]
    path.with_name(path.name + ".csv").write_text("\n".join(lines) + "\n")


def write_sleap(path, names, points):
    """One camera, as SLEAP's project, its analysis or NWB, by sleap-io."""
    import sleap_io

    path.parent.mkdir(parents=True, exist_ok=True)
    skeleton = sleap_io.Skeleton(list(names), name="person")
    video = sleap_io.Video(f"{path.stem}.mp4", open_backend=False)
    track = sleap_io.Track("one")
    frames = [
        sleap_io.LabeledFrame(
            video,
            k,
            [
                sleap_io.PredictedInstance.from_numpy(
                    p[:, :2], skeleton=skeleton, point_scores=p[:, 2], score=0.9, track=track
                )
                for p in people
            ],
        )
        for k, people in enumerate(points)
    ]
    labels = sleap_io.Labels(frames)
    if path.suffix == ".h5":
        sleap_io.save_analysis_h5(labels, str(path))
    else:
        sleap_io.save_file(labels, str(path))


def write_coco_images(path, cameras, names, points, of):
    """All cameras in one file, matched by `folders` of images, or by `cameras` of images; or with `scores` as v."""
    images, annotations = [], []
    for v, camera in enumerate(cameras):
        for k, people in enumerate(points[:, v]):
            name = f"{k:06d}.jpg" if of == "cameras" else f"{camera}/{k:06d}.jpg"
            image = {"id": len(images) + 1, "file_name": name, "width": 640, "height": 480}
            images.append(image | ({"camera": camera, "video_frame": k} if of == "cameras" else {}))
            for person in people:
                rows = person.copy()
                rows[:, 2] = 2 if of != "scores" else 0.8
                flat = np.where(np.isfinite(rows), rows, 0).ravel().round(3).tolist()
                extra = {"score": 0.7} if of == "cameras" else {}
                annotation = {"id": len(annotations), "image_id": images[-1]["id"], "category_id": 1, "keypoints": flat}
                annotations.append(annotation | extra)
    categories = [{"id": 1, "name": "person", "keypoints": list(names)}]
    path.write_text(json.dumps({"images": images, "annotations": annotations, "categories": categories}))


def write_c3d(path, names, points, rate):
    """Points, metres, as C3D in millimetres, by ezc3d."""
    import ezc3d

    data = ezc3d.c3d()
    data["parameters"]["POINT"]["RATE"]["value"] = [rate]
    data["parameters"]["POINT"]["LABELS"]["value"] = tuple(names)
    data["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    values = np.ones((4, points.shape[1], points.shape[0]))
    values[:3] = np.transpose(points * 1000, (2, 1, 0))
    data["data"]["points"] = values
    data.write(str(path))


def write_points_csv(path, names, points, rate, unit):
    path.parent.mkdir(parents=True, exist_ok=True)
    suffix = f"_{unit}" if unit else ""
    lines = [",".join(["frame", "time_s", *(f"{n}.{a}{suffix}" for n in names for a in "xyz")])]
    for k, row in enumerate(points * (1000 if unit == "mm" else 1)):
        lines.append(",".join([str(k), f"{k / rate:.9f}", *("" if np.isnan(x) else f"{x:.9f}" for x in row.ravel())]))
    path.write_text("\n".join(lines) + "\n")


def write_bvh_chain(path):
    """Three joints and an end, two frames, centimetres."""
    path.write_text(
        "HIERARCHY\nROOT Hips\n{\n\tOFFSET 0 0 0\n"
        "\tCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
        "\tJOINT LeftUpLeg\n\t{\n\t\tOFFSET 10 0 0\n\t\tCHANNELS 3 Zrotation Xrotation Yrotation\n"
        "\t\tJOINT LeftLeg\n\t\t{\n\t\t\tOFFSET 0 -40 0\n\t\t\tCHANNELS 3 Zrotation Xrotation Yrotation\n"
        "\t\t\tEnd Site\n\t\t\t{\n\t\t\t\tOFFSET 0 -40 0\n\t\t\t}\n\t\t}\n\t}\n}\n"
        "MOTION\nFrames: 2\nFrame Time: 0.0333333\n"
        "10 20 30 90 0 0 0 0 0 0 90 0\n10 20 30 90 0 0 0 0 0 0 0 0\n"
    )


def convert_c3d(path, kind):
    """Rewrite the numbers of a C3D file of Intel's reals: as whole numbers, as SGI's or as DEC's."""
    data = bytearray(path.read_bytes())
    parameters = 512 * (data[0] - 1)
    block = int.from_bytes(data[16:18], "little")
    start, n_points = 512 * (block - 1), int.from_bytes(data[2:4], "little")
    n_frames = int.from_bytes(data[8:10], "little") - int.from_bytes(data[6:8], "little") + 1
    reals = np.frombuffer(bytes(data[start : start + 16 * n_points * n_frames]), "<f4").copy()

    def real(values):
        values = np.atleast_1d(np.asarray(values, "<f4"))
        if kind == "big-endian":
            return values.astype(">f4").tobytes()
        return np.ascontiguousarray((values * 4).view("<u2").reshape(-1, 2)[:, ::-1]).tobytes()

    if kind == "integers":
        scale = np.abs(reals).max() / 16_000
        data[12:16] = np.float32(scale).tobytes()
        rows = reals.reshape(-1, 4)
        rows[:, :3] /= scale
        path.write_bytes(bytes(data[:start]) + np.round(rows).astype("<i2").tobytes())
        return
    for at in (12, 20):
        data[at : at + 4] = real(np.frombuffer(bytes(data[at : at + 4]), "<f4"))
    data[parameters + 3] = 86 if kind == "big-endian" else 85
    if kind == "big-endian":
        for at in (2, 4, 6, 8, 16):
            data[at : at + 2] = data[at : at + 2][::-1]
        at = parameters + 4
        while data[at]:
            length = abs(int.from_bytes(data[at : at + 1], "little", signed=True))
            after = at + 2 + length
            step = int.from_bytes(data[after : after + 2], "little")
            data[after : after + 2] = data[after : after + 2][::-1]
            if not step:
                break
            at = after + step
    path.write_bytes(bytes(data[:start]) + real(reals))
