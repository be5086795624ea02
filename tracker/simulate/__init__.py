"""Simulated recordings with known truth: smooth-skinned people filmed in a furnished room.

Three inner rooms: `motion` (postures, choreography, scenes), `people` (skeleton, skin, clothes) and `stage` (room,
cameras, rendering). Imports `geometry`, `body`, `formats`, `footage` and `session`. Callers use `simulate`.
"""

from tracker.simulate.record import Simulation, simulate

__all__ = ["Simulation", "simulate"]
