from .compare import compare_sets as compare_sets
from .comparison import Comparison as Comparison
from .comparison import Point as Point
from .comparison import SetResult as SetResult
from .mode_counts import mode_counts as mode_counts
