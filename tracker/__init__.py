"""Model-based tracking of people in calibrated multi-camera footage. Other programs import `quadrille`."""
