"""Small files of key points in pictures as detectors and programs for labels write them, one function each.

Points are x, y, confidence of people in each view, (n_frames, n_views, n_people, n_points, 3).
"""

import hashlib
import json

import numpy as np

SIZE = (640, 480)


def _pairs(points):
    return points[:, :2].round(4).tolist()


def _triples(points):
    return points.round(4).tolist()


def digest(k, n):
    """A hash in hexadecimal digits."""
    return hashlib.md5(str(k).encode(), usedforsecurity=False).hexdigest()[:n]


def write_easymocap(folder, cameras, names, points):
    for v, camera in enumerate(cameras):
        (folder / "annots" / camera).mkdir(parents=True)
        for k, people in enumerate(points[:, v]):
            annots = [{"personID": i, "bbox": [1, 2, 3, 4, 1], "keypoints": _triples(p)} for i, p in enumerate(people)]
            data = {"filename": f"images/{camera}/{k:06d}.jpg", "height": 480, "width": 640, "annots": annots}
            (folder / "annots" / camera / f"{k:06d}.json").write_text(json.dumps(data))


def write_mmpose(folder, cameras, names, points):
    folder.mkdir()
    for v, camera in enumerate(cameras):
        named = {"keypoint_id2name": {str(i): name for i, name in enumerate(names)}}
        frames = [{"frame_id": k + 1, "instances": _instances(people)} for k, people in enumerate(points[:, v])]
        (folder / f"{camera}.json").write_text(json.dumps({"meta_info": named, "instance_info": frames}))


def write_mmpose_pictures(folder, cameras, names, points):
    for v, camera in enumerate(cameras):
        (folder / camera).mkdir(parents=True)
        for k, people in enumerate(points[:, v]):
            (folder / camera / f"{k:06d}.json").write_text(json.dumps(_instances(people)))


def _instances(people):
    return [{"keypoints": _pairs(p), "keypoint_scores": p[:, 2].tolist(), "bbox": [[1, 2, 3, 4]]} for p in people]


def write_alphapose(folder, cameras, names, points):
    for v, camera in enumerate(cameras):
        (folder / camera).mkdir(parents=True)
        found = [
            {
                "image_id": f"{k}.jpg",
                "category_id": 1,
                "keypoints": p.round(4).ravel().tolist(),
                "score": 2.9,
                "idx": [1],
            }
            for k, people in enumerate(points[:, v])
            for p in people
        ]
        (folder / camera / "alphapose-results.json").write_text(json.dumps(found))


def write_roboflow(folder, cameras, names, points):
    folder.mkdir()
    images, annotations = [], []
    for v, camera in enumerate(cameras):
        for k, people in enumerate(points[:, v]):
            name = f"{camera}_{k:06d}_jpg.rf.{digest((v, k), 32)}.jpg"
            images.append({"id": len(images), "file_name": name, "width": 640, "height": 480})
            for p in people:
                flat = np.where(np.arange(3) == 2, 2, p).round(4).ravel().tolist()
                one = {"id": len(annotations), "image_id": images[-1]["id"], "category_id": 1, "keypoints": flat}
                annotations.append(one)
    data = {"images": images, "annotations": annotations, "categories": [{"id": 1, "name": "a", "keypoints": names}]}
    (folder / "_annotations.coco.json").write_text(json.dumps(data))


def write_label_studio(folder, cameras, names, points):
    folder.mkdir()
    tasks = []
    for v, camera in enumerate(cameras):
        for k, people in enumerate(points[:, v]):
            regions = [
                {
                    "type": "keypointlabels",
                    "original_width": SIZE[0],
                    "original_height": SIZE[1],
                    "parentID": f"box{i}",
                    "value": {"x": (x + 0.5) / SIZE[0] * 100, "y": (y + 0.5) / SIZE[1] * 100, "keypointlabels": [name]},
                }
                for i, p in enumerate(people)
                for name, (x, y, _) in zip(names, p.tolist(), strict=True)
            ]
            image = f"/data/upload/1/{digest((v, k), 8)}-{camera}_{k:06d}.jpg"
            annotations = [{"result": [*regions, {"type": "rectanglelabels", "value": {"x": 1}}]}]
            tasks.append({"id": len(tasks), "data": {"img": image}, "annotations": annotations})
    (folder / "project-1.json").write_text(json.dumps(tasks))


def write_cvat_images(folder, cameras, names, points):
    folder.mkdir()
    for v, camera in enumerate(cameras):
        rows = ["<annotations>", "<version>1.1</version>"]
        for k, people in enumerate(points[:, v]):
            rows.append(f'<image id="{k}" name="frame_{k:06d}.PNG" width="640" height="480">')
            rows += [_skeleton(names, p, "") for p in people]
            rows.append("</image>")
        (folder / f"{camera}.xml").write_text("\n".join(['<?xml version="1.0"?>', *rows, "</annotations>"]))


def write_cvat_video(folder, cameras, names, points):
    folder.mkdir()
    for v, camera in enumerate(cameras):
        size = "<original_size><width>640</width><height>480</height></original_size>"
        rows = [f"<annotations><meta><task>{size}</task></meta>"]
        for i in range(points.shape[2]):
            rows.append(f'<track id="{i}" label="person">')
            rows += [_skeleton(names, p, f'frame="{k}" ') for k, p in enumerate(points[:, v, i])]
            rows.append("</track>")
        (folder / f"{camera}.xml").write_text("\n".join([*rows, "</annotations>"]))


def write_cvat_points(folder, cameras, names, points):
    """Every second picture, the points one by one, without skeletons."""
    folder.mkdir()
    for v, camera in enumerate(cameras):
        rows = ["<annotations>"]
        for i, name in enumerate(names):
            shapes = [
                f'<points frame="{k}" outside="0" occluded="0" points="{p[i, 0]:.4f},{p[i, 1]:.4f}"></points>'
                for k, p in enumerate(points[:, v, 0])
                if k % 2
            ]
            rows += [f'<track id="{i}" label="{name}">', *shapes, "</track>"]
        (folder / f"{camera}.xml").write_text("\n".join([*rows, "</annotations>"]))


def _skeleton(names, points, frame):
    inner = [
        f'<points label="{name}" outside="0" occluded="0" points="{x:.4f},{y:.4f}"></points>'
        for name, (x, y, _) in zip(names, points, strict=True)
    ]
    return f'<skeleton {frame}label="person">{"".join(inner)}</skeleton>'


def write_yolo(folder, cameras, names, points):
    """The labels of predictions, with a last score; beside them the names of the classes."""
    for v, camera in enumerate(cameras):
        (folder / camera).mkdir(parents=True)
        (folder / camera / "classes.txt").write_text("person\n")
        for k, people in enumerate(points[:, v]):
            lines = []
            for p in people:
                shares = p.copy()
                shares[:, :2] = (p[:, :2] + 0.5) / SIZE
                lines.append(" ".join(["0 0.5 0.5 0.2 0.4", *(f"{x:.7f}" for x in shares.ravel()), "0.93"]))
            (folder / camera / f"{camera}_{k:06d}.txt").write_text("\n".join(lines) + "\n")


def write_sleap_csv(folder, cameras, names, points):
    folder.mkdir()
    for v, camera in enumerate(cameras):
        heads = [f"{name}.{part}" for name in names for part in ("x", "y", "score")]
        lines = [",".join(["track", "frame_idx", "instance.score", *heads])]
        for k, people in enumerate(points[:, v]):
            for i, p in enumerate(people):
                cells = ["" if np.isnan(x) else f"{x:.4f}" for x in p.ravel()]
                lines.append(",".join([f"track_{i}", str(k), "0.98", *cells]))
        (folder / f"labels.v001.000_{camera}.analysis.csv").write_text("\n".join(lines) + "\n")


def write_eks(folder, cameras, names, points, likelihood=0.97):
    folder.mkdir()
    for v, camera in enumerate(cameras):
        columns = [(name, c) for name in names for c in ("x", "y", "likelihood", "x_ens_median", "y_posterior_var")]
        lines = [
            ",".join(["scorer", *["eks"] * len(columns)]),
            ",".join(["bodyparts", *(n for n, _ in columns)]),
            ",".join(["coords", *(c for _, c in columns)]),
        ]
        for k, p in enumerate(points[:, v, 0]):
            cells = [f"{value:.4f}" for x, y, _ in p for value in (x, y, likelihood, x + 7, 1.0)]
            lines.append(",".join([str(k), *cells]))
        (folder / f"multicam_{camera}_results.csv").write_text("\n".join(lines) + "\n")


def write_hand_labels(folder, cameras, names, points, n_cells=1):
    """Every third picture, as a person labels them in DeepLabCut; the index in one cell or three."""
    for v, camera in enumerate(cameras):
        inside = folder / "labeled-data" / camera
        inside.mkdir(parents=True)
        blank = [""] * (n_cells - 1)
        columns = [(name, c) for name in names for c in "xy"]
        lines = [
            ",".join(["scorer", *blank, *["ann"] * len(columns)]),
            ",".join(["bodyparts", *blank, *(n for n, _ in columns)]),
            ",".join(["coords", *blank, *(c for _, c in columns)]),
        ]
        for k, p in enumerate(points[:, v, 0]):
            if k % 3 == 1:
                index = ["labeled-data", camera, f"img{k:03d}.png"]
                index = index if n_cells == 3 else ["/".join(index)]
                lines.append(",".join([*index, *(f"{x:.4f}" for x in p[:, :2].ravel())]))
        (inside / "CollectedData_ann.csv").write_text("\n".join(lines) + "\n")


WRITERS = {
    "easymocap": write_easymocap,
    "mmpose": write_mmpose,
    "mmpose pictures": write_mmpose_pictures,
    "alphapose": write_alphapose,
    "roboflow": write_roboflow,
    "label studio": write_label_studio,
    "cvat images": write_cvat_images,
    "cvat video": write_cvat_video,
    "yolo": write_yolo,
    "sleap csv": write_sleap_csv,
    "eks": write_eks,
    "hand labels": write_hand_labels,
}
"""Writes the files of a program to a folder, of cameras, names of points, and points."""
FORMATS = {
    "roboflow": "coco",
    "cvat images": "cvat",
    "cvat video": "cvat",
    "eks": "deeplabcut",
    "hand labels": "deeplabcut",
}
"""The name under which a program is stored, where that is another."""
BY_HAND = ("roboflow", "label studio", "cvat images", "cvat video", "hand labels")
"""Programs whose points a person sets."""
