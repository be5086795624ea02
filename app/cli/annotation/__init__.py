"""The commands for datasets: plan, next click, merge, compare, share."""
