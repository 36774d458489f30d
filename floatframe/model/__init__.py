"""The model: what a user describes, from bodies and joints to forces, functions and elements."""

import lazy_loader

# a namespace of `floatframe`, imported when it is first used
__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, ["shapes"])
