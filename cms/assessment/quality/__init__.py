"""Quality: numbers with a tolerance, a verdict, the reason and the next action, for any reduced body.

`check_body` reads a modal file alone, `check_reduction` compares it with the full model.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
