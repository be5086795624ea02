"""Poses and bodies from evidence: the fit, the search, three trackers, runs, first poses, sizes.

Proposers and residuals are here; each tracker is a room that chooses among them. The wing may import those up to
`evidence`. It is given a session and writes none.
"""
