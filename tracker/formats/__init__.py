"""Foreign and own file formats, one module each."""
