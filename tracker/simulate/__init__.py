"""Simulated recordings with known truth: smooth-skinned people filmed in a furnished room.

Inner rooms: `motion` (postures, choreography, scenes), `people` (skeleton, skin, clothes) and `stage` (room,
cameras, rendering); above it `experiments`. Nothing of the product imports the wing but the command that
simulates and the benchmarks. Callers use `simulate`.
"""

from tracker.simulate.record import Simulation, simulate

__all__ = ["Simulation", "simulate"]
