"""`quadrille bench` and the frames it works on."""
