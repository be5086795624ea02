"""State to the annotation store and back; what cannot be written waits."""
