"""Reports: presentation of records without computation."""

import lazy_loader

# The public names are listed in __init__.pyi. A module is imported when one of its names is first used.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
