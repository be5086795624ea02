"""A person's hand in the library: drags, picks, turns, mirrored and copied poses, one frame fitted to pins, a pose
carried over to other sizes."""
