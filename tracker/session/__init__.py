"""What a session folder is, who may write it, how it is made from loose files."""
