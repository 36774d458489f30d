"""Studies that a job file requests: mesh convergence, correlation with a test."""

import lazy_loader

# the public names are listed in __init__.pyi; each module is imported when its name is first used
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
