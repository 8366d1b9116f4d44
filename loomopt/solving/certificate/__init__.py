"""The certificate: a proven local optimum, computed apart from the solver."""
