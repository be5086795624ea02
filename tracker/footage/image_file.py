"""Decode image files, and masks that other programs wrote: grey, alpha and palette images.

Sizes are read from the header and checked before any pixel is decoded.
"""

import struct
import zlib
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow

from tracker.errors import RecordingError
from tracker.geometry.arrays import Image

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
MAX_PIXELS = 80_000_000
"""Largest number of pixels of an image or of a video's frame. A film camera of 12288x6480 has 79.6 million.

A file of a hundred kilobytes can promise any size, and decoding it would take all memory.
"""
_MAX_BYTES = 8 * MAX_PIXELS
"""Largest size of an image file: four channels of 16 bits, not compressed."""
NO_HEADER = (OSError, ValueError, SyntaxError, LookupError, TypeError, OverflowError, struct.error)
"""The errors by which Pillow says that bytes are no image that it knows."""


def read_image(path: Path, where: str) -> Image:
    """Read an image as 8-bit RGB, (H, W, 3); `where` begins the message.

    Raises:
        RecordingError: the file is missing, not an image or too large.
    """
    image = read_image_or_none(path, where)
    if image is None:
        raise RecordingError(f"{where}: {path} is damaged or not an image; export it again")
    return image


def read_image_or_none(path: Path, where: str) -> Image | None:
    """Read an image as 8-bit RGB, (H, W, 3); None if it is damaged.

    Raises:
        RecordingError: the file is missing or too large.
    """
    image = decode_image(read_bytes(path, where), f"{where}: {path}")
    return None if image is None else np.asarray(image, dtype=np.uint8)


def read_unchanged(path: Path, where: str) -> NDArray[np.generic] | None:
    """Read an image with the channels and the depth of the file, (H, W) or (H, W, C); None if it is damaged.

    Raises:
        RecordingError: the file is missing or too large.
    """
    return decode_image(read_bytes(path, where), f"{where}: {path}", cv2.IMREAD_UNCHANGED)


def decode_image(data: bytes, where: str, flags: int = cv2.IMREAD_COLOR_RGB) -> NDArray[np.generic] | None:
    """Decode the bytes of an image file with flags of OpenCV; None if they are damaged or no image.

    Raises:
        RecordingError: the image is too large.
    """
    try:
        with Pillow.open(BytesIO(data)) as header:
            size = header.size
    except Pillow.DecompressionBombError:
        raise RecordingError(too_large(where, "more than twice as many")) from None
    except NO_HEADER:
        return None
    check_pixels(size, where)
    try:
        image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), flags)
    except cv2.error:  # a header that Pillow accepts and OpenCV does not
        return None
    return None if image is None else np.asarray(image)


def check_pixels(size: tuple[int, int], where: str) -> None:
    """Check the size of an image, width and height, before it is decoded.

    Raises:
        RecordingError: it has more than `MAX_PIXELS`.
    """
    if size[0] * size[1] > MAX_PIXELS:
        raise RecordingError(too_large(where, f"{size[0]}x{size[1]}"))


def too_large(where: str, found: str) -> str:
    """Return that an image has too many pixels."""
    return f"{where}: expected at most {MAX_PIXELS // 10**6} million pixels, found {found}; reduce it"


def read_bytes(path: Path, where: str) -> bytes:
    """Read the file of an image; `where` begins the message.

    Raises:
        RecordingError: it is missing, no file, or too large.
    """
    try:
        if path.exists() and not path.is_file():  # a pipe or a device would be read for ever
            raise RecordingError(f"{where}: expected a file, found {path}, which is none; check the path")
        # Not cv2.imread, which cannot open every path on every system and prints.
        if (size := path.stat().st_size) > _MAX_BYTES:
            raise RecordingError(
                f"{where}: expected an image of at most {_MAX_BYTES // 10**6} MB, found {size // 10**6} MB in {path}; "
                "export it again"
            )
        return path.read_bytes()
    except OSError as error:
        raise RecordingError(f"{where}: cannot read {path}: {error.strerror}; check the path") from error


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
