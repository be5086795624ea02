"""Replace key points in JSON of OpenPose and COCO, and leave all other bytes as they are."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tracker.formats.keypoints.coco_reading import read_dataset
from tracker.formats.keypoints.picture_table import Changes
from tracker.formats.text_patch import PIXEL_DECIMALS, Span, SpanList, TextPatch, number_like
from tracker.geometry.arrays import Array


def patch_openpose(path: Path, changes: Mapping[int, Changes]) -> bytes:
    """Return the file of a picture with points of some people replaced; numbers are those among people with points.

    Args:
        path: the file, which has been read before.
        changes: of its only camera and row.
    """
    patch = TextPatch(path.read_bytes())
    people = patch.json_spans()["people"]
    numbers = [p["pose_keypoints_2d"].items for p in people.items if "pose_keypoints_2d" in p]
    with_points = [some for some in numbers if some]
    for person, values in changes[0][0]:
        if person < 0:
            patch.append(people, f'{{"person_id": [-1], "pose_keypoints_2d": [{_triples(values, has_flags=False)}]}}')
        else:
            _replace_triples(patch, with_points[person], values, has_flags=False)
    return patch.encoded()


def patch_coco(path: Path, changes: Mapping[int, Changes]) -> bytes:
    """Return a file with points of some people replaced; all other bytes stay, but for the counts of their points.

    In a file with flags of visibility, a point that is replaced keeps its flag, or is visible if it was absent.

    Args:
        path: the file, which has been read before.
        changes: by the number of the camera in the order of `read_coco`, and by row of its table.
    """
    found, patch = read_dataset(path), TextPatch(path.read_bytes())
    spans = patch.json_spans()
    annotations: SpanList = spans if isinstance(spans, SpanList) else spans["annotations"]
    of_image: dict[int | str, list[dict[str, Any]]] = {}
    for annotation, own in zip(found.dataset.annotations, annotations.items, strict=True):
        if annotation.category_id == found.category and annotation.keypoints:
            of_image.setdefault(annotation.image_id, []).append(own)
    has_flags, next_id = found.has_flags, _next_id(annotations, patch)
    for camera, rows in changes.items():
        images = list(found.images.values())[camera]
        numbers = sorted(images)
        for row, people in rows.items():
            image_id = images[numbers[row]].id
            for person, values in people:
                if person < 0:
                    number = None if annotations is spans else next_id
                    patch.append(annotations, _annotation(values, has_flags, image_id, found.category, number))
                    next_id += 1
                    continue
                own = of_image[image_id][person]
                before, after = _replace_triples(patch, own["keypoints"].items, values, has_flags)
                if isinstance(count := own.get("num_keypoints"), tuple) and after != before:
                    patch.replace(count, str(after))
    return patch.encoded()


def _replace_triples(patch: TextPatch, spans: Sequence[Span], values: Array, has_flags: bool) -> tuple[int, int]:
    """Replace x, y, v of a person; return how many points were there before, and how many are now."""
    is_there = [float(patch.old(span)) != 0 for span in spans[2::3]]
    before = sum(is_there)
    for i, (x, y, confidence) in enumerate(values.tolist()):
        if confidence != confidence:
            continue
        *of_place, v_span = spans[3 * i : 3 * i + 3]
        was_there, is_there[i] = is_there[i], confidence > 0
        for span, value in zip(of_place, (x, y), strict=True):
            patch.replace_number(span, value if is_there[i] else 0.0, PIXEL_DECIMALS)
        if has_flags:
            patch.replace(v_span, "0" if not is_there[i] else patch.old(v_span) if was_there else "2")
        else:
            patch.replace_number(v_span, confidence, PIXEL_DECIMALS)
    return before, sum(is_there)


def _triples(values: Array, has_flags: bool) -> str:
    """Return x, y, v of the points of a new person; 0 for absent ones."""
    rows = np.where(values[:, 2:] > 0, values, 0.0)
    cells = [[number_like(cell, "", PIXEL_DECIMALS) for cell in row] for row in rows.tolist()]
    if has_flags:
        cells = [[x, y, "2" if v else "0"] for (x, y, _), v in zip(cells, rows[:, 2], strict=True)]
    return ", ".join(cell for row in cells for cell in row)


def _next_id(annotations: SpanList, patch: TextPatch) -> int:
    """Return a number above those of all annotations."""
    ids = [own.get("id") for own in annotations.items]
    return 1 + max((int(float(patch.old(span))) for span in ids if isinstance(span, tuple)), default=0)


def _annotation(values: Array, has_flags: bool, image_id: int | str, category: int, number: int | None) -> str:
    """Return the annotation of a person who was not found; with a number in a dataset, else in a list of results."""
    known, triples = values[values[:, 2] > 0, :2], _triples(values, has_flags)
    fields = {"image_id": json.dumps(image_id), "category_id": str(category), "keypoints": f"[{triples}]"}
    if number is None:
        fields["score"] = "1.0"
    else:
        low, high = known.min(axis=0), known.max(axis=0)
        box = ", ".join(number_like(x, "", PIXEL_DECIMALS) for x in (*low, *(high - low)))
        area = number_like(float(np.prod(high - low)), "", PIXEL_DECIMALS)
        fields = {"id": str(number)} | fields
        fields |= {"num_keypoints": str(len(known)), "bbox": f"[{box}]", "area": area, "iscrowd": "0"}
    return "{" + ", ".join(f'"{key}": {value}' for key, value in fields.items()) + "}"
