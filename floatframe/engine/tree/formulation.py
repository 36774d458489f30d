"""The names of the two formulations: coordinates of bodies ("absolute") or of joints ("relative")."""

from fe_models.foundation.words import nearest
from floatframe.errors import ModelError

__all__ = ["FORMULATIONS", "is_relative"]

FORMULATIONS = ("absolute", "relative")  #: names of the formulations


def is_relative(formulation: str) -> bool:
    """Whether a formulation uses joint coordinates; `ModelError` if the name is unknown."""
    if formulation not in FORMULATIONS:
        raise ModelError(
            f"formulation: expected one of {', '.join(FORMULATIONS)}, got {formulation!r}"
            f"{nearest(str(formulation), FORMULATIONS)}"
        )
    return formulation == "relative"
