"""Read masks that other programs wrote: grey, alpha and palette images whose values tell people from the background."""

import zlib
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow

from tracker.errors import RecordingError
from tracker.footage.image_file import NO_HEADER, check_pixels, read_bytes, too_large

_BROKEN = (*NO_HEADER, zlib.error, EOFError, MemoryError)
"""The errors by which Pillow says that the pixels of an image are damaged."""

ANYONE = np.iinfo(np.uint8).max
"""Label of a pixel of a mask of footage that is of some person."""
UNKNOWN = ANYONE - 1
"""Label of a pixel that may be of a person: an object stands before it, or a network was not sure."""


class LabelImage(NamedTuple):
    """An image of one value a pixel; 0 is background."""

    labels: NDArray[Any]
    """(H, W), uint8 or uint16."""
    is_alpha: bool = False
    """Whether the values are the opacity of a picture that was cut out."""


def read_label_image(path: Path, where: str) -> LabelImage:
    """Read a mask in PNG: its opacity if it has any, else its grey values or the numbers of its colours.

    Args:
        path: of the file.
        where: begins messages.

    Raises:
        RecordingError: the file is missing, damaged, too large or a colour picture, or colour 0 of its palette is no
            background.
    """
    data, where = read_bytes(path, where), f"{where}: {path}"
    try:
        with Pillow.open(BytesIO(data), formats=("PNG",)) as image:
            check_pixels(image.size, where)
            image.verify()  # checksums: some damaged data can be decoded
        with Pillow.open(BytesIO(data), formats=("PNG",)) as image:
            if image.mode == "P":
                _check_background(image, where)
                return LabelImage(np.asarray(image, dtype=np.uint8))
            return _labels(image if image.mode != "1" else image.convert("L"), where)
    except Pillow.DecompressionBombError:
        raise RecordingError(too_large(where, "more than twice as many")) from None
    except _BROKEN as error:
        raise RecordingError(f"{where} is damaged or no PNG image; export it again") from error


def _labels(image: Pillow.Image, where: str) -> LabelImage:
    """Return the labels of an image that has no palette.

    Raises:
        RecordingError: it is a colour picture.
    """
    if image.mode in ("LA", "RGBA"):
        *colors, alpha = (np.asarray(band) for band in image.split())
        if alpha.size and alpha.min() < np.iinfo(np.uint8).max:
            return LabelImage(alpha, is_alpha=True)
    else:
        colors = [np.asarray(band) for band in image.split()]
    if any(not np.array_equal(colors[0], other) for other in colors[1:]):
        raise RecordingError(
            f"{where}: expected a mask of one value a pixel, found a colour picture; export it as a grey "
            "or palette image"
        )
    labels = colors[0]
    return LabelImage(labels if labels.dtype == np.uint8 else np.clip(labels, 0, None).astype(np.uint16))


def _check_background(image: Pillow.Image, where: str) -> None:
    first, opacity = tuple((image.getpalette() or [])[:3]), image.info.get("transparency")
    is_clear = opacity == 0 if isinstance(opacity, int) else bool(opacity) and opacity[0] == 0
    if any(first) and not is_clear:
        raise RecordingError(
            f"{where}: expected black or transparent as colour 0 of the palette, the background, found {first}; "
            "export it as a grey image"
        )


def parts_of_mask(
    mask: NDArray[np.uint8], person: int | None = None
) -> tuple[NDArray[np.uint8], NDArray[np.uint8] | None]:
    """Return the pixels of people, and those that are unknown, as `read_mask` labels them, (H, W) each, 0 elsewhere.

    Args:
        mask: of a picture of footage, (H, W).
        person: index of a person in the session, whose own label counts beside `ANYONE`; None for everybody.

    Returns:
        Both; the second is None if nothing is unknown.
    """
    unknown = mask == UNKNOWN
    if person is not None:
        people = ((mask == ANYONE) | (mask == person + 1)).astype(np.uint8)
    else:
        people = np.where(unknown, np.uint8(0), mask)
    return people, unknown.astype(np.uint8) if unknown.any() else None
