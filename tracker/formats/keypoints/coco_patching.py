"""Replace key points in a COCO file and leave all other bytes as they are."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tracker.formats.exact_text import PIXEL_DECIMALS, exact_text, number_like
from tracker.formats.json_numbers import Span, SpanList, json_spans, replace_spans
from tracker.formats.keypoints.coco_reading import read_dataset
from tracker.geometry.arrays import Array

PersonChanges = Sequence[tuple[int, Array]]
"""Number of a person among those of the image, or -1 for a new one, and x, y, confidence of all points, (n_points, 3);
rows of NaN stay, confidence 0 makes a point absent."""


def patch_coco(path: Path, changes: Mapping[int, Mapping[int, PersonChanges]]) -> bytes:
    """Return a file with points of some people replaced; all other bytes stay, but for the counts of their points.

    In a file with flags of visibility, a point that is replaced keeps its flag, or is visible if it was absent.

    Args:
        path: the file, which has been read before.
        changes: by the number of the camera in the order of `read_coco`, and by row of its table.
    """
    found, exact = read_dataset(path), exact_text(path.read_bytes())
    spans = json_spans(exact.text)
    annotations: SpanList = spans if isinstance(spans, SpanList) else spans["annotations"]
    of_image: dict[int | str, list[dict[str, Any]]] = {}
    for annotation, own in zip(found.dataset.annotations, annotations.items, strict=True):
        if annotation.category_id == found.category and annotation.keypoints:
            of_image.setdefault(annotation.image_id, []).append(own)
    new: dict[Span, str] = {}
    added: list[str] = []
    has_flags, first_id = found.has_flags, _next_id(annotations, exact.text)
    for camera, rows in changes.items():
        images = list(found.images.values())[camera]
        numbers = sorted(images)
        for row, people in rows.items():
            image_id = images[numbers[row]].id
            for person, values in people:
                if person < 0:
                    number = None if annotations is spans else first_id + len(added)
                    added.append(_annotation(values, has_flags, image_id, found.category, number))
                else:
                    _replace(of_image[image_id][person], values, exact.text, has_flags, new)
    if added:
        begin = ", " if annotations.items else ""
        new[annotations.end, annotations.end] = begin + ", ".join(added)
    return exact.encoded(replace_spans(exact.text, new))


def _replace(own: dict[str, Any], values: Array, text: str, has_flags: bool, new: dict[Span, str]) -> None:
    """Replace points of an annotation, and the number of its points if that changes."""
    spans = own["keypoints"].items
    is_there = [float(text[slice(*span)]) != 0 for span in spans[2::3]]
    before = sum(is_there)
    for i, (x, y, confidence) in enumerate(values.tolist()):
        if confidence != confidence:
            continue
        x_span, y_span, v_span = spans[3 * i : 3 * i + 3]
        old = text[slice(*v_span)]
        sure = (old if is_there[i] else "2") if has_flags else number_like(confidence, old, PIXEL_DECIMALS)
        is_there[i] = confidence > 0
        for span, value in ((x_span, x), (y_span, y)):
            new[span] = number_like(value if is_there[i] else 0.0, text[slice(*span)], PIXEL_DECIMALS)
        new[v_span] = sure if is_there[i] else "0"
    count = own.get("num_keypoints")
    if isinstance(count, tuple) and sum(is_there) != before:
        new[count] = str(sum(is_there))


def _next_id(annotations: SpanList, text: str) -> int:
    """Return a number above those of all annotations."""
    ids = [own.get("id") for own in annotations.items]
    return 1 + max((int(float(text[slice(*span)])) for span in ids if isinstance(span, tuple)), default=0)


def _annotation(values: Array, has_flags: bool, image_id: int | str, category: int, number: int | None) -> str:
    """Return the annotation of a person who was not found; with a number in a dataset, else in a list of results."""
    is_known = values[:, 2] > 0
    rows = np.where(is_known[:, None], values, 0.0)
    cells = []
    for x, y, confidence in rows.tolist():
        sure = str(2 * (confidence > 0)) if has_flags else number_like(confidence, "", PIXEL_DECIMALS)
        cells += [number_like(x, "", PIXEL_DECIMALS), number_like(y, "", PIXEL_DECIMALS), sure]
    fields = {"image_id": json.dumps(image_id), "category_id": str(category), "keypoints": f"[{', '.join(cells)}]"}
    if number is None:
        fields["score"] = "1.0"
    else:
        low, high = rows[is_known, :2].min(axis=0), rows[is_known, :2].max(axis=0)
        box = ", ".join(number_like(x, "", PIXEL_DECIMALS) for x in (*low, *(high - low)))
        area = number_like(float(np.prod(high - low)), "", PIXEL_DECIMALS)
        fields = {"id": str(number)} | fields
        fields |= {"num_keypoints": str(int(is_known.sum())), "bbox": f"[{box}]", "area": area, "iscrowd": "0"}
    return "{" + ", ".join(f'"{key}": {value}' for key, value in fields.items()) + "}"
