"""Footage: random access to frame k of every camera, packet lists, proxies, backgrounds and masks.

A frame is bit-identical however it is reached. Imports `geometry`. Callers use `recording.Recording`,
`camera_source.CameraSource`, `video.open_footage`, `proxy.Proxy` and `video_writer.VideoWriter`.
"""

__all__ = [
    "camera_source",
    "chapters",
    "flash",
    "frame_rates",
    "image_file",
    "image_folder",
    "proxy",
    "recording",
    "sound",
    "start_times",
    "video",
    "video_writer",
]
