"""Recordings with known truth: smooth-skinned people filmed in a furnished room.

`scenes` moves skeletons (`skeleton`), alone (`moves`) or two together (`pairs`); `skin` (from `anatomy`, `builds` and
`surface_nets`, dressed by `outfit`) or `parts` gives them a surface; `room` and `furniture` stand around them; `rig`
mounts the cameras; `render` and `film` make images; `encode` and `record` write them into a session folder.
"""

from tracker.simulate.record import Simulation, simulate

__all__ = ["Simulation", "simulate"]
