"""The engine: the compiled model, the kernels of its equations, and consistent initial conditions."""
