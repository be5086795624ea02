"""Footage to what poses are scored against: per view the edges, the distance image, the silhouette, the colours;
one frame ahead."""
