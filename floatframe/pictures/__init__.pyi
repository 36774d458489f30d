from .mode_film import animate_mode as animate_mode
from .mode_film import draw_mode as draw_mode
from .viewer.modes_view import view_modes as view_modes
