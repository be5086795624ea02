"""Write datasets of one or several recordings: pictures, labels, splits, checksums, a card.

`dataset` plans and writes them.
"""

__all__ = ["card", "dataset", "splits"]
