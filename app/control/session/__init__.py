"""The state of the open session under its lock, and what watches beside it: history, footage, kernels."""
