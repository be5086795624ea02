"""The stage of a simulated recording: room, furniture, cameras, rendering, video."""
