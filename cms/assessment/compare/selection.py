"""What an automatic selection of modes returns, and its limits."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from cms.modes.mode_set import ModeSet
from fe_models.foundation.presentation import presented

__all__ = ["FEWEST", "MOST", "Selection", "Trial"]

FEWEST = 8  #: number of modes of the first set that is computed
MOST = 300  #: default number of modes above which the search fails


@dataclass(frozen=True)
class Trial:
    """Result of a set with one number of modes."""

    n_modes: int
    n_columns: int  #: number of columns of the mode set, including static columns
    error: float  #: error in the chosen measure; inf if a mode of the band is missing, or the set could not be computed
    where: str  #: place of the largest error, for messages


@presented
@dataclass(frozen=True, eq=False)
class Selection:
    """Chosen mode set and the reason for the choice."""

    modes: ModeSet
    n_modes: int
    error: float  #: error with the chosen number of modes
    history: tuple[Trial, ...]  #: results for all numbers of modes that were tried, ascending
    sentence: str  #: the choice and its reason in words
    options: Mapping[str, str] = field(default_factory=dict)  #: options that the caller gave

    def __post_init__(self) -> None:
        object.__setattr__(self, "options", MappingProxyType(dict(self.options)))
