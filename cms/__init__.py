"""Component mode synthesis: from a finite element body to a small, exact, portable modal file.

body = couple(fe_body)
modes = craig_bampton(body, n_modes=12)
write(reduce(body, modes, frame=NodalFrame("big_end")), "rod.h5")
"""

import lazy_loader

# The public names are listed in __init__.pyi. A module is imported when one of its names is first used, and a function
# checks its arguments (`at_door`).
attribute, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    found = attribute(name)
    from cms.errors import ArgumentError
    from fe_models.foundation.records import at_door

    return at_door(__name__, name, found, ArgumentError)
