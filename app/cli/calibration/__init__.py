"""Commands that make and check calibrations: `quadrille calibrate` and `quadrille check`. Imports `app.cli`."""
