"""A flexible link whose identified mass, stiffness and damping differ from its finite element model.

If the density is multiplied by mu and the moduli by kappa, the shapes do not change. With M-orthonormal modes, q
becomes sqrt(mu) q, so that

    m, S, R -> mu (.),   C1, P -> sqrt(mu) (.),   Psi -> Psi / sqrt(mu),   omega² -> kappa/mu omega²,

Geometric stiffness by interface forces is divided by mu; geometric stiffness by accelerations does not change. Except
for frequencies and stresses, this is a change of the unit of mass by 1/mu, and the modal file states the unit of every
entry. Uniform factors are the main errors of a model: density and modulus of a material, thickness of a tube. If the
shapes of a body are wrong, its finite element model must be updated.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cms.body.modal_file.file import convert_units
from cms.body.reduced_body import ReducedBody
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody

__all__ = ["scaled_link"]


def scaled_link(
    body: FlexibleBody, *, mass: float = 1.0, stiffness: float = 1.0, damping: Sequence[float] | None = None
) -> FlexibleBody:
    """Return a flexible body with its mass and stiffness multiplied by factors, and with given damping ratios.

    Parameters
    ----------
    body
        The body of the finite element model. Load cases are kept; recovery tables are removed.
    mass, stiffness
        Factors of density and moduli, above 0.
    damping
        Ratio of each mode in the frame of the reduced body, the last one for all further modes; None: the ratios stay.

    Raises
    ------
    ModelError
        If a factor is not above 0, or a ratio below 0.
    """
    for name, value in (("mass", mass), ("stiffness", stiffness)):
        if not 0 < value < np.inf:
            raise ModelError(f"scaled_link of {body.name!r}: {name}: expected a factor above 0, got {value:.6g}")
    scaled = scaled_body(body.reduced, float(mass), float(stiffness))
    if damping is not None:
        given = np.asarray(damping, dtype=float)
        if given.ndim != 1 or not len(given) or not (given >= 0).all():
            raise ModelError(
                f"scaled_link of {body.name!r}: damping: expected ratios of 0 or more, one for each mode, got {damping}"
            )
        ratios = given[np.minimum(np.arange(scaled.n_q), len(given) - 1)]
        omega = np.where(np.diag(scaled.M) > 0, np.sqrt(np.maximum(np.diag(scaled.K), 0.0)), 0.0)
        scaled = replace(scaled, D=np.diag(2 * ratios * omega))
    return replace(body, reduced=scaled)


def scaled_body(reduced: ReducedBody, mass: float, stiffness: float) -> ReducedBody:
    """Return a reduced body with density and moduli multiplied by factors."""
    lighter = replace(reduced.units, name="scaled", mass=reduced.units.mass / mass)
    made = replace(convert_units(replace(reduced, recovery={}), lighter), units=reduced.units)
    ratio = stiffness / mass  # the change of the unit of mass alone multiplies the moduli by `mass`
    loads = tuple(
        replace(case, h=case.h / mass, force=case.force / mass, torque=case.torque / mass) for case in made.load_cases
    )
    columns, root = made.columns, np.sqrt(ratio)
    return replace(
        made,
        columns=None if columns is None else replace(columns, A=columns.A * root, F=columns.F * root),
        K=made.K * ratio,
        D=made.D * root,
        free_frequencies=made.free_frequencies * root,
        stress=None if made.stress is None else made.stress * ratio,
        point_stress=None
        if made.point_stress is None
        else replace(made.point_stress, modes=made.point_stress.modes * ratio),
        load_cases=loads,
        errors=None if made.errors is None else replace(made.errors, left_out=None),
        provenance=dict(reduced.provenance) | {"scaled": f"mass {mass:.9g}, stiffness {stiffness:.9g}"},
    )
