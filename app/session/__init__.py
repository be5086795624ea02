"""What the program keeps of an open session's footage."""
