"""Where simulated people are filmed: rooms, furniture, cameras, rendering."""
