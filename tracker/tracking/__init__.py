"""What all trackers share: the estimate of a frame, its status, what is remembered of a person, where to look,
whose edge is whose."""
