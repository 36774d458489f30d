"""Mean stress: the amplitude, at the stress ratio of the curve, with the same damage as a cycle with another mean.

With the amplitude S_a, the mean S_m and S_max = S_a + S_m, a correction gives the fully reversed amplitude S_ar
(R = -1) of a cycle. The equivalent amplitude S at the stress ratio R of the curve has the same S_ar; cycles of the
curve have the mean c S with c = (1 + R) / (1 - R).

- none: S = S_a.
- goodman: S_ar = S_a / (1 - S_m / R_m), R_m tensile strength; soderberg and morrow: the same with the yield strength
  and with the fatigue strength coefficient sigma_f'.
- gerber: S_ar = S_a / (1 - (S_m / R_m)²).
- swt (Smith, Watson and Topper 1970): S_ar = sqrt(S_max S_a); walker (1970): S_ar = S_max^(1 - g) S_a^g. Cycles with
  S_max <= 0 do no damage.
- fkm: sensitivity M, straight pieces of S_ar over S_m: S_a (1 - M) for R > 1; S_a + M S_m for R <= 0;
  (1 + M) (S_a + M/3 S_m) / (1 + M/3) for 0 < R < 1/2; 3 (1 + M)² S_a / (3 + M) for R >= 1/2.

Goodman, Soderberg, Morrow and Gerber treat a compressive mean as zero unless `credit_compression` is set.
"""

import math
from dataclasses import dataclass

from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import FatigueError, ModelError

__all__ = ["MEAN_STRESS", "NO_CORRECTION", "MeanStress"]

NONE, LINE, GERBER, SWT, WALKER, FKM = range(6)

#: code of the law in the kernel, name of its parameter, and description of the parameter, by name
MEAN_STRESS = {
    "none": (NONE, "", ""),
    "goodman": (LINE, "tensile_strength", "tensile strength"),
    "soderberg": (LINE, "yield_strength", "yield strength"),
    "morrow": (LINE, "fatigue_strength_coefficient", "fatigue strength coefficient sigma_f'"),
    "gerber": (GERBER, "tensile_strength", "tensile strength"),
    "swt": (SWT, "", ""),
    "walker": (WALKER, "walker_exponent", "Walker's exponent, 0 to 1"),
    "fkm": (FKM, "mean_stress_sensitivity", "mean stress sensitivity M, 0 to 1"),
}


@dataclass(frozen=True)
@checked_fields(ModelError)
class MeanStress:
    """A mean stress correction and its parameter.

    Parameters
    ----------
    name
        One of `MEAN_STRESS`.
    value
        Parameter of the correction: a strength [Pa], Walker's exponent, or the sensitivity M.
    credit_compression
        Whether a compressive mean stress increases the life; for goodman, soderberg and morrow.
    """

    name: str = "none"
    value: float = 0.0
    credit_compression: bool = False

    def __post_init__(self) -> None:
        if self.name not in MEAN_STRESS:
            raise FatigueError(f"mean stress: unknown correction {quoted(self.name)}{nearest(self.name, MEAN_STRESS)}")
        law, key, words = MEAN_STRESS[self.name]
        if law in (LINE, GERBER) and not (math.isfinite(self.value) and self.value > 0):
            raise FatigueError(
                f"mean stress: {self.name}: expected the {words} above 0, got {self.value:g}; give {key}"
            )
        if law in (WALKER, FKM) and not 0 <= self.value <= 1:
            raise FatigueError(f"mean stress: {self.name}: expected {words}, got {self.value:g}; give {key}")
        if self.credit_compression and law != LINE:
            raise FatigueError(
                f"mean stress: {self.name}: credit_compression is for goodman, soderberg and morrow; this law "
                "defines the effect of compression itself"
            )

    @property
    def law(self) -> int:
        """Code of the law in the kernels."""
        return MEAN_STRESS[self.name][0]

    @property
    def description(self) -> str:
        """Description of the correction and its parameter."""
        key = MEAN_STRESS[self.name][1].replace("_", " ")
        return f"{self.name} ({key} {self.value:.6g})" if key else self.name

    def limit(self, largest: float, /) -> float:
        """Return kappa with S_ar <= kappa S_a for all cycles between -largest and largest; inf if there is no bound.

        goodman, soderberg and morrow: 1 / (1 - largest / R_m); gerber: with the square; fkm: 3 (1 + M)² / (3 + M).
        """
        if self.law == NONE:
            return 1.0
        if self.law == FKM:
            return 3 * (1 + self.value) ** 2 / (3 + self.value)
        if self.law in (LINE, GERBER) and largest < self.value:
            share = largest / self.value
            return 1 / (1 - (share if self.law == LINE else share**2))
        return math.inf


NO_CORRECTION = MeanStress()
