"""How simulated people move: postures, choreography, couples."""
