"""The stage of a simulated recording: room, furniture, cameras, rendering, video."""

__all__ = ["camera_rig", "film", "rasterizer", "room"]
