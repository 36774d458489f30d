"""Over which dofs given columns are: those of the coupled body, or those of its mesh, which may be as many."""

import logging

import numpy as np

from cms.errors import ModeSetError
from cms.mode_sets.mesh_field import coupled_field
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted

__all__ = ["OVER", "coupled_columns", "tell_frequencies"]

log = logging.getLogger(__name__)

OVER = ("coupled", "mesh")  #: dofs that columns can be given over
WORDS = {"coupled": "coupled dofs", "mesh": "dofs of the mesh"}
DEARER = 10.0  #: median omega² of columns over that of the other reading, above which the other one is meant
NOT_RIGID = 0.1  #: part of the motion of a rigid interface that its members cannot follow, that is told
APART = 3.0  #: factor between a stated frequency and that of a column's energy, that is told


def coupled_columns(where: str, body: FEBody, V: Array, over: str | None) -> tuple[Array, dict[str, str]]:
    """Bring given columns to the dofs of the coupled body.

    (1) which dofs the rows are: as told, or as their number tells; where both have as many, it must be told
    (2) columns over the mesh go the way of `coupled_field`
    (3) where both readings are possible, that which is told may not be far dearer than the other

    Parameters
    ----------
    where
        Start of messages.
    V
        Finite columns, (n_dof, k) or (n_mesh_dof, k).
    over
        One of `OVER`; None: as the number of rows tells.

    Returns
    -------
    columns
        (n_dof, k).
    options
        What was done, for the record of the mode set.

    Raises
    ------
    ModeSetError
        If the rows fit neither, or both and nothing tells which, or are told to be one and look like the other.
    """
    over = told_or_counted(where, body, V, over)  # (1)
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
                f'{where}: columns_over = "{over}": read so, the columns vibrate at {own / (2 * np.pi):.4g} per time '
                f"unit (median of sqrt(uᵀKu / uᵀMu) / 2 pi), as {WORDS[other]} at {else_ / (2 * np.pi):.4g}; say "
                f'columns_over = "{other}", or mend the order of the rows'
            )
    return columns, options


def told_or_counted(where: str, body: FEBody, V: Array, over: str | None) -> str:
    """Return over which dofs the columns are."""
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
            f"{where}: columns: {len(V)} rows may be the dofs of the coupled body or those of its mesh, which stand in "
            'another order; say which: columns_over = "coupled" or columns_over = "mesh"'
        )
    return fitting[0]


def n_mesh(body: FEBody) -> int:
    """Return the number of dofs of the mesh."""
    return body.n_dof if body.recovery is None else int(body.recovery.matrix.shape[0])


def has_own_mesh(body: FEBody) -> bool:
    """Whether the dofs of the mesh are others than those of the coupled body, or stand in another order."""
    return body.recovery is not None and not np.array_equal(body.recovery.dofs, body.dofs)


def is_ambiguous(body: FEBody) -> bool:
    """Whether the number of rows does not tell the dofs of the mesh from those of the coupled body."""
    return has_own_mesh(body) and n_mesh(body) == body.n_dof


def rayleigh(body: FEBody, X: Array) -> Array:
    """Rayleigh quotient of every column, (k,) [1/s²]; 0 where there is no mass."""
    mass = np.einsum("nk,nk->k", X, body.M @ X)
    energy = np.maximum(np.einsum("nk,nk->k", X, body.K @ X), 0.0)
    return np.divide(energy, mass, out=np.zeros_like(energy), where=mass > 0)


def tell_frequencies(where: str, body: FEBody, X: Array, frequencies: Array) -> None:
    """Warn of stated frequencies that the energy of their columns is far from: another order, unit or body.

    Parameters
    ----------
    X
        Columns over the coupled dofs, (n_dof, k).
    frequencies
        NaN for static columns, (k,) [Hz].
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
            "%s: column %d is said to vibrate at %.5g, its energy gives %.5g (per time unit); are rows, units and "
            "frequencies those of this body?", where, np.flatnonzero(is_stated)[k] + 1, stated[k], own[k],
        )  # fmt: skip
