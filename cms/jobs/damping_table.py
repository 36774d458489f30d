"""The table [damping] of a job: the damping of the modes (docs/job_file.md)."""

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, model_validator

from cms.reduction.basis.damping import (
    CUSTOMARY_STEPS,
    Damping,
    ModalDamping,
    PerModeDamping,
    RampDamping,
    RayleighDamping,
)
from fe_models.foundation.toml_file import Table, is_no_number

__all__ = ["DampingSection"]

Ratio = Annotated[float, Field(ge=0, le=1)]
Coefficient = Annotated[float, Field(ge=0)]


def ratio_list(value: Any) -> tuple[float, ...]:
    """Return damping ratios, one for each mode."""
    if not isinstance(value, list | tuple) or not value or any(is_no_number(x) or not 0 <= x <= 1 for x in value):
        raise ValueError("expected a list of numbers, 0 to 1, one per mode; the last holds for all further modes")
    return tuple(float(x) for x in value)


def ramp_steps(value: Any) -> tuple[tuple[float, float], ...]:
    """Return steps (frequency in Hz, ratio below it); true selects the customary steps."""
    if value is True:
        return CUSTOMARY_STEPS
    pairs = value if isinstance(value, list | tuple) else ()
    is_pair = [
        isinstance(p, list | tuple)
        and len(p) == 2
        and not any(is_no_number(x) or x < 0 for x in p)
        and p[1] <= 1  # critical
        for p in pairs
    ]
    frequencies = [pair[0] for pair, good in zip(pairs, is_pair, strict=True) if good]
    if not pairs or not all(is_pair) or frequencies[0] <= 0 or sorted(set(frequencies)) != frequencies:
        raise ValueError("expected true, or pairs [frequency in Hz, ratio below it] by ascending frequency")
    return tuple((float(frequency), float(ratio)) for frequency, ratio in pairs)


class DampingSection(Table):
    """[damping]: ratios of the modes, or Rayleigh damping."""

    ratio: Ratio | None = Field(None, description="a number, 0 to 1, of critical damping (0.01 is 1 %)")
    ratios: Annotated[tuple[float, ...], BeforeValidator(ratio_list)] | None = Field(
        None, description="a list of numbers, 0 to 1, of critical damping, one per mode"
    )
    ramp: Annotated[tuple[tuple[float, float], ...], BeforeValidator(ramp_steps)] | None = Field(
        None, description="true, or pairs [frequency in Hz, ratio below it]"
    )
    above: Ratio | None = Field(None, description="a number, 0 to 1, the ratio above the last step of the ramp")
    alpha: Coefficient | None = Field(None, description="a number, 0 or more, of D = alpha M + beta K")
    beta: Coefficient | None = Field(None, description="a number, 0 or more, of D = alpha M + beta K")

    @model_validator(mode="after")
    def _one_kind(self) -> "DampingSection":
        given = [key for key in ("ratio", "ratios", "ramp", "alpha", "beta") if getattr(self, key) is not None]
        if len({"rayleigh" if key in ("alpha", "beta") else key for key in given}) != 1:
            got = " and ".join(given) or "none of them"
            raise ValueError(f"expected either ratio, ratios, ramp, or alpha and beta; got {got}")
        if self.above is not None and self.ramp is None:
            raise ValueError(f"above belongs to ramp; got {given[0]}")
        return self

    @property
    def damping(self) -> Damping:
        """The damping that the table describes."""
        if self.ratio is not None:
            return ModalDamping(self.ratio)
        if self.ratios is not None:
            return PerModeDamping(self.ratios)
        if self.ramp is not None:
            return RampDamping(self.ramp, 1.0 if self.above is None else self.above)
        return RayleighDamping(self.alpha or 0.0, self.beta or 0.0)
