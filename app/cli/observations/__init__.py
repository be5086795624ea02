"""The commands that import observations and judge them."""
