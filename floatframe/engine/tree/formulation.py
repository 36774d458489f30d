"""The two formulations by name: coordinates of bodies, or of joints."""

from fe_models.foundation.words import nearest
from floatframe.errors import ModelError

__all__ = ["FORMULATIONS", "is_relative"]

FORMULATIONS = ("absolute", "relative")  #: by their names


def is_relative(formulation: str) -> bool:
    """Whether a formulation is the one in coordinates of joints; `ModelError` if the name is unknown."""
    if formulation not in FORMULATIONS:
        raise ModelError(
            f"formulation: expected one of {', '.join(FORMULATIONS)}, got {formulation!r}"
            f"{nearest(str(formulation), FORMULATIONS)}"
        )
    return formulation == "relative"
