"""Check whether given columns are over the dofs of the coupled body or of its mesh, which may be equally many."""

import logging

import numpy as np

from cms.errors import ModeSetError
from cms.modes.mode_sets.mesh_field import coupled_field
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted

__all__ = ["OVER", "coupled_columns", "log_frequencies"]

log = logging.getLogger(__name__)

OVER = ("coupled", "mesh")  #: dofs over which columns can be given
WORDS = {"coupled": "coupled dofs", "mesh": "dofs of the mesh"}
#: ratio of the median omega² of the columns to that of the other interpretation, above which the other one is meant
DEARER = 10.0
#: share of the motion of a rigid interface that its members cannot follow, above which a warning is given
NOT_RIGID = 0.1
APART = 3.0  #: ratio between a stated frequency and that from the energy of its column, above which a warning is given


def coupled_columns(where: str, body: FEBody, V: Array, over: str | None) -> tuple[Array, dict[str, str]]:
    """Convert given columns to the dofs of the coupled body.

    (1) identify the dofs of the rows, from the argument or from their number; if both have the same number, the
        argument is needed
    (2) convert columns over the mesh with `coupled_field`
    (3) if both interpretations are possible, check that the chosen one does not have a far higher energy than the other

    Parameters
    ----------
    where
        Start of messages.
    V
        Finite columns, (n_dof, k) or (n_mesh_dof, k).
    over
        One of `OVER`; None: identify the dofs from the number of rows.

    Returns
    -------
    columns
        (n_dof, k).
    options
        Description of the conversion, for the record of the mode set.

    Raises
    ------
    ModeSetError
        If the number of rows fits neither, if it fits both and `over` is None, or if the columns contradict `over`.
    """
    over = stated_or_counted(where, body, V, over)  # (1)
    options = {"columns over": f"the {WORDS[over]}"}
    columns = V
    if over == "mesh":  # (2)
        field = coupled_field(body, V)
        columns = field.columns
        for name, part in field.departure.items():
            options[f"motion of interface {name} that is not rigid"] = f"{part:.3g}"
            if part > NOT_RIGID:
                log.warning("%s: %.0f %% of the motion of rigid interface %r in some column is not rigid and is left "
                            "out", where, 100 * part, name)  # fmt: skip
    if is_ambiguous(body):  # (3)
        other = OVER[1 - OVER.index(over)]
        read = {"coupled": V, "mesh": columns if over == "mesh" else coupled_field(body, V).columns}
        own, else_ = (float(np.sqrt(np.median(rayleigh(body, read[name])))) for name in (over, other))
        if own**2 > DEARER * else_**2:
            raise ModeSetError(
                f'{where}: columns_over = "{over}": in this order, the columns vibrate at {own / (2 * np.pi):.4g} per '
                "time "
                f"unit (median of sqrt(uᵀKu / uᵀMu) / 2 pi), as {WORDS[other]} at {else_ / (2 * np.pi):.4g}; give "
                f'columns_over = "{other}", or correct the order of the rows'
            )
    return columns, options


def stated_or_counted(where: str, body: FEBody, V: Array, over: str | None) -> str:
    """Return over which dofs the columns are given."""
    if over is not None and over not in OVER:
        raise ModeSetError(f"{where}: columns_over = {quoted(over)}: unknown{nearest(str(over), OVER)}")
    rows = {"coupled": body.n_dof, "mesh": n_mesh(body)}
    if not has_own_mesh(body):
        rows = {"coupled": body.n_dof} if over is None else {over: body.n_dof}
    asked = rows if over is None else {over: rows[over]}
    fitting = [name for name, n in asked.items() if V.ndim == 2 and V.shape[1] and len(V) == n]
    if not fitting:
        expected = " or ".join(f"({n}, k) over the {WORDS[name]}" for name, n in asked.items())
        raise ModeSetError(f"{where}: columns: expected {expected}, got {V.shape}")
    if len(fitting) > 1:
        raise ModeSetError(
            f"{where}: columns: {len(V)} rows may be the dofs of the coupled body or those of its mesh, which have "
            'another order; give columns_over = "coupled" or columns_over = "mesh"'
        )
    return fitting[0]


def n_mesh(body: FEBody) -> int:
    """Return the number of dofs of the mesh."""
    return body.n_dof if body.recovery is None else int(body.recovery.matrix.shape[0])


def has_own_mesh(body: FEBody) -> bool:
    """Whether mesh dofs and coupled dofs differ in number or order."""
    return body.recovery is not None and not np.array_equal(body.recovery.dofs, body.dofs)


def is_ambiguous(body: FEBody) -> bool:
    """Whether mesh dofs and coupled dofs differ but are equally many."""
    return has_own_mesh(body) and n_mesh(body) == body.n_dof


def rayleigh(body: FEBody, X: Array) -> Array:
    """Return the Rayleigh quotient of every column, (k,) [1/s²]; 0 for columns without mass."""
    mass = np.einsum("nk,nk->k", X, body.M @ X)
    energy = np.maximum(np.einsum("nk,nk->k", X, body.K @ X), 0.0)
    return np.divide(energy, mass, out=np.zeros_like(energy), where=mass > 0)


def log_frequencies(where: str, body: FEBody, X: Array, frequencies: Array) -> None:
    """Warn if stated frequencies are far from those of the energy of their columns: order, unit or body may be wrong.

    Parameters
    ----------
    X
        Columns over the coupled dofs, (n_dof, k).
    frequencies
        Stated frequencies, NaN for static columns, (k,) [Hz].
    """
    is_stated = np.isfinite(frequencies) & (frequencies > 0)
    own = np.sqrt(rayleigh(body, X[:, is_stated])) / (2 * np.pi)
    stated = frequencies[is_stated]
    is_known = own > 0
    if not is_known.any():
        return
    apart = np.abs(np.log(own[is_known] / stated[is_known]))
    if np.median(apart) > np.log(APART):
        k = np.flatnonzero(is_known)[int(np.argmax(apart))]
        log.warning(
            "%s: column %d has the stated frequency %.5g, but its energy gives %.5g (per time unit); check that "
            "rows, units and frequencies belong to this body",
            where, np.flatnonzero(is_stated)[k] + 1, stated[k], own[k],
        )  # fmt: skip
