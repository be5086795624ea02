"""Several people on one session: who has joined, a controller for each, who is where.

`participants.Participants` lets pages join by name and role. Each person has a frame, selection and undo of their own.
"""
