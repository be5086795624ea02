"""`quadrille`, or `python -m quadrille`: the command line, from any folder."""

import sys

from quadrille import PLACE

sys.path.insert(0, PLACE)  # before the working folder and PYTHONPATH, which may hold another project's `app`
from app.main import program

if __name__ == "__main__":
    program()
