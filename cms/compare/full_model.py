"""The reference solution of the full model that mode sets are compared with, computed once and kept in a file."""

import hashlib
import logging
import zipfile
from dataclasses import dataclass, fields
from io import BytesIO
from pathlib import Path

import numpy as np
import scipy.sparse.linalg as sla

from cms.arrays import Array, frozen
from cms.compare.pulse import Pulse
from cms.errors import CompareError
from cms.families import Families
from cms.fe_body import FEBody
from cms.paths import replace_file
from cms.rigid_modes import geometric_rigid_modes

__all__ = ["FullModel", "read_full_model", "reference_digest", "solve_full_model", "write_full_model"]

log = logging.getLogger(__name__)

VERSION = "1"  #: of what is computed; a file of another version is made anew
MODES_ABOVE_BAND = 4  #: free modes found for each one in the band: what lies above answers nearly statically there
FEWEST_MODES = 24
MASS_TOLERANCE = 1e-10  #: relative residual of the solutions with M_II


@dataclass(frozen=True, eq=False)
class FullModel:
    """Free modes, static responses and a short motion of the full model.

    Frequencies are in cycles per time unit of the body, displacements over all its dofs.
    """

    band: float  #: highest frequency of the comparison
    omega2: Array  #: elastic free modes, more than the band holds, (n_modes,) [1/s²]
    rigid: Array  #: M-orthonormal rigid-body modes, (n_dof, n_r)
    Phi: Array  #: M-orthonormal elastic free modes, (n_dof, n_modes)
    Psi_A: Array  #: attachment modes without rigid-body motion: static interface loads, (n_dof, n_e)
    Psi_H: Array  #: inertia-relief modes without rigid-body motion: static inertia loads, (n_dof, n_r)
    G_bb: Array  #: elastic flexibility of the free body at the boundary, (n_b, n_b) [m/N]
    u_pulse: Array  #: elastic static response of the free body to the pulse, (n_dof, 1)
    directions: Array  #: geometric rigid-body modes about the centre of mass, (n_dof, 6)
    held_mass: Array  #: of those directions, what moves while the interfaces are held, (6,) [kg, kg m²]
    mass: Array  #: of those directions, of the whole body, (6,) [kg, kg m²]

    def __post_init__(self) -> None:
        object.__setattr__(self, "band", float(self.band))
        for field in fields(self):
            if field.name != "band":
                object.__setattr__(self, field.name, frozen(getattr(self, field.name)))

    @property
    def frequencies(self) -> Array:
        """Elastic free frequencies, (n_modes,)."""
        return np.sqrt(self.omega2) / (2 * np.pi)

    @property
    def n_band(self) -> int:
        """Number of elastic free modes in the band."""
        return int((self.frequencies <= self.band * (1 + 1e-9)).sum())

    @property
    def parts(self) -> dict[str, slice]:
        """Where the families stand in `columns`."""
        slices, at = {}, 0
        for name in ("rigid", "Phi", "Psi_A", "Psi_H", "u_pulse", "directions"):
            width = getattr(self, name).shape[1]
            slices[name], at = slice(at, at + width), at + width
        return slices

    @property
    def columns(self) -> Array:
        """All displacements side by side, (n_dof, n_columns)."""
        return np.hstack([getattr(self, name) for name in self.parts])


def solve_full_model(families: Families, pulse: Pulse, *, n_modes: int, band: float | None) -> FullModel:
    """Solve the full model.

    Parameters
    ----------
    families
        Of the body; its factorisation serves here too.
    pulse
        The force of the reference motion.
    n_modes
        Elastic free modes the band holds, where no band is given.
    band
        Highest frequency [cycles per time unit of the body]; None: that of mode n_modes.

    Raises
    ------
    CompareError
        If no elastic mode lies in the band.
    """
    body = families.body
    n_most = body.n_dof - families.Psi_R.shape[1] - 1
    if band is not None:
        n_band = len(families.free_modes(cutoff=band).omega2)
        if n_band == 0:
            first = families.free_modes(n_modes=1).frequencies[0] / body.units.time
            raise CompareError(
                f"band: up to {band / body.units.time:g} Hz, but the first elastic mode of body {body.name!r} is at "
                f"{first:.6g} Hz; choose a band that holds modes"
            )
    else:
        n_band = min(n_modes, n_most)
    modes = families.free_modes(n_modes=min(max(MODES_ABOVE_BAND * n_band, FEWEST_MODES), n_most))
    directions = centered_directions(body)
    Psi_U = families.Psi_U
    return FullModel(
        band=float(modes.frequencies[n_band - 1]) if band is None else band,
        omega2=modes.omega2,
        rigid=families.free.N,
        Phi=modes.Phi,
        Psi_A=deformation(families, families.Psi_A),
        Psi_H=deformation(families, families.Psi_H),
        G_bb=Psi_U[body.b],
        u_pulse=Psi_U @ pulse.direction[:, None],
        directions=directions,
        held_mass=held_mass(families, directions),
        mass=np.einsum("nk,nk->k", directions, body.M @ directions),
    )


def deformation(families: Families, u: Array) -> Array:
    """Return displacements without their rigid-body motion, u - N Nᵀ M u, which costs the energy norm its digits."""
    free = families.free
    return u - free.N @ (free.M_N.T @ u)


def centered_directions(body: FEBody) -> Array:
    """Return the geometric rigid-body modes about the centre of mass, (n_dof, 6), mesh axes."""
    moved = geometric_rigid_modes(body)
    M_moved = body.M @ moved
    mass = moved[:, 0] @ M_moved[:, 0]
    if mass <= 0:
        return moved
    # S = int c from the products of translations and rotations: d_x · theta_y gives S_z, d_y · theta_z S_x, …
    products = moved[:, :3].T @ M_moved[:, 3:]
    center = np.array([products[1, 2], products[2, 0], products[0, 1]]) / mass
    return geometric_rigid_modes(body, origin=center)


def held_mass(families: Families, directions: Array) -> Array:
    """Return sum of the effective masses of all fixed-interface modes, (6,): b_Iᵀ M_II⁻¹ b_I, b = M d.

    Its complement sits at the interfaces and moves with them.
    """
    body, fixed = families.body, families.fixed
    M_ii, b = fixed.M_ii, (body.M @ directions)[fixed.i]
    diagonal = M_ii.diagonal()
    has_mass = np.flatnonzero(diagonal > 0)
    M_ii, b, diagonal = M_ii[has_mass][:, has_mass], b[has_mass], diagonal[has_mass]
    precondition = sla.LinearOperator(M_ii.shape, matvec=lambda x: x / diagonal)
    total = np.zeros(b.shape[1])
    for k in range(b.shape[1]):
        if np.abs(b[:, k]).max(initial=0.0) > 0:
            x, _ = sla.cg(M_ii, b[:, k], rtol=MASS_TOLERANCE, M=precondition, maxiter=2000)
            total[k] = x @ b[:, k]
    return total


# The file -------------------------------------------------------------------------------------------------------------


def reference_digest(body: FEBody, *asked: object) -> str:
    """Return a digest of all that the reference solution depends on: matrices, dofs, interfaces, what was asked for."""
    digest = hashlib.sha256(repr((VERSION, asked)).encode())
    for matrix in (body.K, body.M):
        for array in (matrix.data, matrix.indices, matrix.indptr):
            digest.update(np.ascontiguousarray(array).data)
    for part in (body.nodes, body.dofs, body.b):
        digest.update(np.ascontiguousarray(part).data)
    return digest.hexdigest()


def write_full_model(path: Path, full: FullModel, digest: str) -> None:
    """Write a reference solution; `OSError` if that fails."""
    buffer = BytesIO()
    arrays = {field.name: getattr(full, field.name) for field in fields(full)}
    np.savez(buffer, digest=np.frombuffer(bytes.fromhex(digest), np.uint8), **arrays)
    replace_file(path, buffer.getvalue())


def read_full_model(path: Path, digest: str) -> FullModel | None:
    """Return the reference solution of that digest, or None if the file holds another one, or none that is whole."""
    if not path.is_file():
        return None
    try:
        with np.load(path, allow_pickle=False) as file:
            if bytes(file["digest"]).hex() != digest:
                return None
            return FullModel(**{field.name: file[field.name] for field in fields(FullModel)})
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        log.warning("%s: not a whole reference solution (%s); it is computed anew", path, error)
        return None
