"""Independent nonlinear models that the floating frame is compared with; test code, not part of the product."""
