"""Files of other programs: meshes (`read_mesh`), whole decks (`decks`), matrices, CAD.

A reader reads exactly, or explains why it cannot.
"""

from fe_models.door import open_door

open_door(__name__, "fe_models.errors:ArgumentError")
