from . import compare as compare
from . import correlation as correlation
from . import quality as quality
from .compare.mode_selection import select_modes as select_modes
from .quality.of_body.buckling import critical_loads as critical_loads
