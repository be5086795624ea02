"""Read masks of people from COCO: polygons, and run lengths as numbers or as text.

Polygons count from the border of the picture, so that the centre of its first pixel is at 0.5, 0.5. Run lengths go
column by column, and the first run is outside. As text they are digits of base 32, the lowest first, in characters from
"0" on; a digit before another one has 32 added. From the fourth on they are differences to the run before the last.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from tracker.errors import FormatError, Remedy
from tracker.formats.keypoints.coco_reading import CocoPicture, read_pictures
from tracker.validation import MAX_SIDE_PX, check, quoted

_PERSON = "person"
_Coordinate = Annotated[
    float, msgspec.Meta(ge=-MAX_SIDE_PX, le=MAX_SIDE_PX, description=f"pixels of at most {MAX_SIDE_PX}")
]
_Polygon = Annotated[list[_Coordinate], msgspec.Meta(min_length=6, description="x and y of three corners or more")]


class _RunLengths(msgspec.Struct):
    size: Annotated[tuple[int, int], msgspec.Meta(description="height and width")]
    counts: str | list[Annotated[int, msgspec.Meta(ge=0, le=MAX_SIDE_PX**2, description="the length of a run")]]


class SegmentedPictures(NamedTuple):
    """The masks of one camera."""

    labels: tuple[str, ...]
    """Names that the camera may have, best first."""
    images: Mapping[int, CocoPicture]
    """By number."""
    people: Mapping[int | str, list[Any]]
    """Segmentations of people by the id of the image."""
    notes: tuple[str, ...]
    where: str
    """Kind and path of the file, for messages."""

    def labels_of(self, number: int, size: tuple[int, int]) -> NDArray[np.uint8]:
        """Return the mask of a picture, (H, W): 1 for people.

        Args:
            number: of the picture.
            size: width and height that it must have, px.

        Raises:
            FormatError: it has another size, or a segmentation is malformed.
        """
        image = self.images[number]
        where = f"{self.where}, image {image.id}"
        if image.width and image.height:
            check_mask_size((image.width, image.height), size, where)
        out = np.zeros(size[::-1], np.uint8)
        for segmentation in self.people.get(image.id, []):
            if isinstance(segmentation, dict):
                out |= _decoded(check(segmentation, _RunLengths, where, FormatError), size, where)
            else:
                for polygon in check(segmentation, list[_Polygon], where, FormatError):
                    _fill(out, polygon, where)
        return out


def read_segmentations(path: Path) -> list[SegmentedPictures]:
    """Read the masks of a dataset or a list of results, those of each camera; a picture without any is empty.

    Raises:
        FormatError: the file is malformed, has no segmentations, or has several categories and none of people.
    """
    where = f"COCO file {path}"
    dataset, by_camera, *_ = read_pictures(path)
    chosen = [a for a in dataset.annotations if a.segmentation]
    if not chosen:
        raise FormatError(f"{where}: expected annotations with a segmentation, found none; export them")
    used = {a.category_id for a in chosen}
    named = {c.id: c for c in dataset.categories}
    of_people = {c.id for c in dataset.categories if _PERSON in (c.name.casefold(), c.supercategory.casefold())}
    if len(used) > 1 and not used & of_people:
        listed = ", ".join(quoted(named[i].name) if i in named else str(i) for i in sorted(used)[:5])
        expected = f"a category named '{_PERSON}' among several"
        raise FormatError.mismatch(where, expected, listed, "rename that of the people")
    taken = used & of_people or used
    notes = ()
    if others := [quoted(named[i].name) if i in named else str(i) for i in sorted(used - taken)]:
        notes = (f"segmentations of {others[0]} and other categories were left out",)
    people: dict[int | str, list[Any]] = {}
    for annotation in chosen:
        if annotation.category_id in taken:
            people.setdefault(annotation.image_id, []).append(annotation.segmentation)
    return [SegmentedPictures(labels, images, people, notes, where) for labels, images in by_camera.items()]


def check_mask_size(found: tuple[int, int], size: tuple[int, int], where: str) -> None:
    """Check the width and height of a mask; `where` begins the message.

    Raises:
        FormatError: it has another size.
    """
    if found != size:
        expected = f"a mask of {size[0]}x{size[1]} pixels"
        seen = f"{found[0]}x{found[1]}"
        raise FormatError.mismatch(where, expected, seen, Remedy("give_picture_size", size=f"{found[0]}x{found[1]}"))


def _fill(out: NDArray[np.uint8], polygon: list[float], where: str) -> None:
    """Fill a polygon with 1; its border lies at the pixels whose centres it passes."""
    if len(polygon) % 2:
        raise FormatError(f"{where}: expected x and y of each corner, found {len(polygon)} numbers; export it again")
    bits = 4  # of the fractions of pixels, which OpenCV takes as whole numbers
    corners = np.round((np.array(polygon).reshape(-1, 2) - 0.5) * 2**bits).astype(np.int32)
    cv2.fillPoly(out, [corners], 1, shift=bits)


def _decoded(found: _RunLengths, size: tuple[int, int], where: str) -> NDArray[np.uint8]:
    """Return a mask that is given by run lengths.

    Raises:
        FormatError: it has another size, or its runs do not fill it.
    """
    check_mask_size((found.size[1], found.size[0]), size, where)
    counts = _counts(found.counts) if isinstance(found.counts, str) else found.counts
    width, height = size
    if min(counts, default=-1) < 0 or sum(counts) != width * height:
        raise FormatError(f"{where}: expected run lengths of {width * height} pixels, found others; export it again")
    is_inside = np.arange(len(counts)) % 2
    return np.repeat(is_inside, counts).astype(np.uint8).reshape(size).T


def _counts(text: str) -> list[int]:
    """Return the run lengths that text stands for; a negative one if it is damaged."""
    out: list[int] = []
    value = shift = 0
    for code in text.encode():
        digit = code - ord("0")
        if not 0 <= digit < 64 or shift > 60:
            return [-1]
        value |= (digit & 0x1F) << shift
        shift += 5
        if not digit & 0x20:
            if digit & 0x10:
                value -= 1 << shift
            out.append(value + (out[-2] if len(out) > 2 else 0))
            value = shift = 0
    return out
