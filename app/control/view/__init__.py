"""What the views show: people, the floor, the 3-D view."""
