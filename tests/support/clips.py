"""Small videos and image folders in which every frame encodes its number."""

from pathlib import Path

import av
import cv2
import numpy as np

N = 60
SIZE = (64, 48)


def picture(i):
    """A frame with a grey centre that encodes its number, and moving texture."""
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    image = np.stack([0 * x, (x * 7 + y * 3 + i * 11) % 256, (x * y + i * 5) % 256], axis=-1)
    image[8:40, 8:56] = i * 4
    return image.astype(np.uint8)


def number(image):
    h, w = image.shape[:2]
    return round(float(image[h // 2 - 6 : h // 2 + 6, w // 2 - 6 : w // 2 + 6, 0].mean()) / 4)


def encode(
    path,
    n=N,
    codec="libx264",
    rate=30,
    gop=12,
    bframes=3,
    times=None,
    pix_fmt="yuv420p",
    options=None,
    container_options=None,
    rotation=None,
    start=0,
):
    with av.open(str(path), "w", options=container_options or {}) as container:
        stream = container.add_stream(codec, rate=rate, options=options or {})
        stream.width, stream.height, stream.pix_fmt = *SIZE, pix_fmt
        stream.codec_context.gop_size = gop
        stream.codec_context.max_b_frames = bframes
        if rotation is not None:
            stream.set_display_rotation(rotation)
        for i in range(n):
            frame = av.VideoFrame.from_ndarray(picture(i), format="rgb24")
            frame.pts = start + (i if times is None else times[i])
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def write_images(folder: Path, names, size=SIZE):
    folder.mkdir()
    for i, name in enumerate(names):
        cv2.imwrite(str(folder / name), np.full((size[1], size[0], 3), (i, 4 * i, 4 * i), np.uint8))
    return folder
