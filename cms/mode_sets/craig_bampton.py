"""Craig-Bampton and Guyan-Irons: constraint modes, with and without fixed-interface vibration modes."""

from contextlib import ExitStack
from dataclasses import replace

import numpy as np

from cms.errors import ModeSetError
from cms.fe_body import FEBody
from cms.fixed_interface import FixedInterfaceBody, fix_interfaces
from cms.mode_set import ModeSet
from cms.static_modes import boundary_groups, boundary_labels, constraint_modes
from cms.vibration_modes import fixed_interface_modes

__all__ = ["craig_bampton", "guyan"]


def craig_bampton(
    body: FEBody,
    *,
    n_modes: int | None = None,
    cutoff: float | None = None,
    verify: bool = False,
    fixed: FixedInterfaceBody | None = None,
) -> ModeSet:
    """Craig-Bampton mode set: [Psi_C, fixed-interface modes] [1]_.

    (1) Psi_C: interior part -K_II⁻¹ K_IB
    (2) K_II phi = omega² M_II phi, all boundary dofs held

    Parameters
    ----------
    body
        A coupled body with at least one interface.
    n_modes
        Number of fixed-interface modes; 0 gives Guyan-Irons.
    cutoff
        Instead of a number: all fixed-interface modes up to this frequency [Hz, or 1/time unit of the body].
    verify
        Prove by the inertia of a factorisation that no mode was missed.
    fixed
        The interior factorisation, to share it with other mode sets; made and freed here by default.

    Raises
    ------
    ModeSetError
        If not exactly one of `n_modes` and `cutoff` is given, or there are fewer interior dofs than modes.
    BodyError
        If the body is a mechanism when its interfaces are held.

    References
    ----------
    .. [1] THEORY §2-3.
    """
    if (n_modes is None) == (cutoff is None):
        raise ModeSetError(
            f"craig_bampton: expected either n_modes or cutoff, got n_modes = {n_modes}, cutoff = {cutoff}"
        )
    if n_modes is not None and n_modes < 0:
        raise ModeSetError(f"craig_bampton: n_modes = {n_modes}; expected 0 or more")
    if cutoff is not None and not cutoff > 0:
        raise ModeSetError(f"craig_bampton: cutoff = {cutoff}; expected a frequency above 0")
    body.require_coupled()
    n_i = body.n_dof - len(body.b)
    if n_modes is not None and n_modes >= n_i:
        raise ModeSetError(
            f"craig_bampton: n_modes = {n_modes}, but body {body.name!r} has {n_i} interior dofs; "
            f"choose 0 <= n_modes < {n_i}"
        )
    with ExitStack() as stack:
        if fixed is None:
            fixed = stack.enter_context(fix_interfaces(body))
        Psi_C = constraint_modes(fixed)
        labels, groups = boundary_labels(body, "constraint"), boundary_groups(body, "constraint")
        options = {"n_modes": "0", "solver": fixed.factorization.description}
        if n_modes == 0:
            return ModeSet("craig-bampton", Psi_C, labels, np.full(len(labels), np.nan), options, groups)
        modes = fixed_interface_modes(fixed, n_modes=n_modes, cutoff=cutoff, verify=verify)
        n_b, n_phi = len(fixed.b), len(modes.frequencies)
        columns = np.zeros((body.n_dof, n_b + n_phi))
        columns[:, :n_b] = Psi_C
        columns[:, n_b:] = modes.Phi
        options |= {"n_modes": str(n_phi), "verified": str(verify), "eigensolver": modes.method}
        if cutoff is not None:
            options["cutoff"] = repr(float(cutoff))
        return ModeSet(
            "craig-bampton",
            columns,
            (*labels, *(f"fixed-interface {k + 1}" for k in range(n_phi))),
            np.concatenate([np.full(n_b, np.nan), modes.frequencies]),
            options,
            (*groups, *["fixed-interface"] * n_phi),
        )


def guyan(body: FEBody, *, fixed: FixedInterfaceBody | None = None) -> ModeSet:
    """Guyan-Irons static condensation: constraint modes only (Craig-Bampton with n_modes = 0)."""
    modes = craig_bampton(body, n_modes=0, fixed=fixed)
    return replace(modes, name="guyan")
