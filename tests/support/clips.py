"""Small videos and image folders in which every frame encodes its number."""

import struct
from fractions import Fraction
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
    matrix=None,
    tags=None,
    telemetry=(),
    first=0,
):
    """A video; its pictures count from `first`, `tags` are of the file, `telemetry` has a piece for each second."""
    with av.open(str(path), "w", options=container_options or {}) as container:
        container.metadata.update(tags or {})
        stream = container.add_stream(codec, rate=rate, options=options or {})
        stream.width, stream.height, stream.pix_fmt = *SIZE, pix_fmt
        stream.codec_context.gop_size = gop
        stream.codec_context.max_b_frames = bframes
        if rotation is not None:
            stream.set_display_rotation(rotation)
        if matrix is not None:  # a, b, c, d: (x, y) goes to (a x + c y, b x + d y)
            a, b, c, d = (round(v * 2**16) for v in matrix)
            stream.set_display_matrix([a, b, 0, c, d, 0, 0, 0, 2**30])
        data = container.add_data_stream("bin_data") if telemetry else None
        for i in range(n):
            frame = av.VideoFrame.from_ndarray(picture(first + i), format="rgb24")
            frame.pts = start + (i if times is None else times[i])
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
        for i, piece in enumerate(telemetry):
            packet = av.Packet(piece)
            packet.stream, packet.time_base, packet.pts, packet.dts, packet.duration = data, Fraction(1), i, i, 1
            container.mux(packet)
    return path


def gpmf(key, kind, size, values):
    """An item of GoPro's telemetry: key, type, size of a value, their number, and the values, padded to four bytes."""
    return struct.pack(">4scBH", key, kind, size, len(values) // size) + values + bytes(-len(values) % 4)


def encode_stamped(path, stamps):
    """A video with given time stamps, in 1/90000 s."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=30)
        stream.width, stream.height, stream.pix_fmt, stream.time_base = *SIZE, "yuv420p", Fraction(1, 90000)
        stream.codec_context.max_b_frames = 0
        stream.codec_context.time_base = Fraction(1, 90000)
        for i, pts in enumerate(stamps):
            frame = av.VideoFrame.from_ndarray(picture(i), format="rgb24")
            frame.pts, frame.time_base = pts, Fraction(1, 90000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def write_images(folder: Path, names, size=SIZE):
    folder.mkdir()
    for i, name in enumerate(names):
        cv2.imwrite(str(folder / name), np.full((size[1], size[0], 3), (i, 4 * i, 4 * i), np.uint8))
    return folder
