"""Motion of simulated people: postures, choreography, solo moves, couples, scenes."""

__all__ = ["postures", "scenes"]
