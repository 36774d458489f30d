"""Quality: numbers with a tolerance, a verdict, the reason and the next action, for any reduced body.

`check_body` reads a modal file alone, `check_reduction` compares it with the full model.
"""

from fe_models.door import open_door

open_door(__name__)
