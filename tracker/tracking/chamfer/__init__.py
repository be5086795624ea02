"""The chamfer tracker (GD96): predict, observe, refine, recover, judge; then the backward pass over what was lost."""
