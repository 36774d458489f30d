"""Reference solution of the full model, to which mode sets are compared; computed once and stored in a file."""

import hashlib
import logging
import zipfile
from dataclasses import dataclass, fields
from io import BytesIO
from pathlib import Path

import numpy as np

from cms.assessment.compare.pulse import Pulse
from cms.assessment.quality.reference.full_reference import moving_mass, static_responses
from cms.assessment.quality.reference.port_model import PortModel
from cms.assessment.quality.reference.ports import Ports
from cms.assessment.quality.reference.reference_response import reference_response
from cms.assessment.quality.reference.transient import Snapshots, transient
from cms.errors import CompareError
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.modes.families.families import Families
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.paths import replace_file
from fe_models.foundation.ranks.spread_matrix import whole_matrix

__all__ = ["ReferenceSolution", "read_full_model", "reference_digest", "solve_full_model", "write_full_model"]

log = logging.getLogger(__name__)

VERSION = "2"  #: version of the computation; results from files of another version are computed again
MODES_BEYOND = 2.0  #: highest frequency of dynamically included free modes, divided by the band
#: number of free modes first requested per mode in the band; this mostly suffices for twice its frequency
FIRST_SEARCH = 3


@dataclass(frozen=True, eq=False)
class ReferenceSolution:
    """Free modes, static responses, interface response and reference motion of the full model.

    Frequencies are in cycles per time unit of the body, displacements over all its dofs, without rigid-body motion.
    """

    band: float  #: highest frequency of the comparison [1 / time unit]
    omega2: Array  #: squared angular frequencies of the elastic free modes up to twice the band, (n_modes,) [1/s²]
    rigid: Array  #: M-orthonormal rigid-body modes, (n_dof, n_r)
    Phi: Array  #: M-orthonormal elastic free modes in the band, (n_dof, n_band)
    Psi_A: Array  #: attachment modes: static responses to interface loads, (n_dof, n_e)
    Psi_H: Array  #: inertia-relief modes: static responses to inertia loads, (n_dof, n_r)
    #: static responses of the free body to its load cases, (n_dof, n_load_cases); zero if a load does not deform it
    Psi_L: Array
    moved: Array  #: displacement columns of the reference motion, (n_dof, k)
    amplitudes: Array  #: amplitudes of these columns over time, (k, n_t)
    t: Array  #: times of the reference motion, (n_t,) [time unit]
    port_omega2: Array  #: squared angular frequencies of the modes in the interface response, (n,) [1/s²]
    port_is_massive: Array  #: 1 for each of these modes that has mass, else 0, (n,)
    port_modes: Array  #: motion of the ports in these modes, (6 n_ports, n)
    port_rigid: Array  #: motion of the ports in the rigid-body modes, (6 n_ports, n_r)
    port_error: float  #: estimated relative error of the interface response at the top of the band
    directions: Array  #: geometric rigid-body modes about the centre of mass, (n_dof, 6)
    held_mass: Array  #: inertia that moves in these directions while the interfaces are fixed, (6,) [kg, kg m²]
    mass: Array  #: inertia of the whole body in these directions, (6,) [kg, kg m²]

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            object.__setattr__(self, field.name, float(value) if field.type is float else frozen(value))

    @property
    def frequencies(self) -> Array:
        """Frequencies of the elastic free modes, (n_modes,)."""
        return np.sqrt(self.omega2) / (2 * np.pi)

    @property
    def n_band(self) -> int:
        """Number of elastic free modes in the band."""
        return self.Phi.shape[1]

    @property
    def parts(self) -> dict[str, slice]:
        """Column indices of each family in `columns`."""
        slices, at = {}, 0
        for name in ("rigid", "Phi", "Psi_A", "Psi_H", "Psi_L", "moved", "directions"):
            width = getattr(self, name).shape[1]
            slices[name], at = slice(at, at + width), at + width
        return slices

    @property
    def columns(self) -> Array:
        """All displacement columns side by side, (n_dof, n_columns)."""
        return np.hstack([getattr(self, name) for name in self.parts])

    def ports(self, names: tuple[str, ...]) -> PortModel:
        """Return the modes at the ports of the named interfaces."""
        return PortModel(names, self.port_omega2, self.port_is_massive > 0.5, self.port_modes, self.port_rigid)


def solve_full_model(
    families: Families,
    pulse: Pulse,
    *,
    n_modes: int,
    band: float | None,
    damping: float,
    motion: Snapshots | None,
    n_expected: int = 0,
) -> ReferenceSolution:
    """Solve the full model.

    Parameters
    ----------
    families
        Mode families of the body; their factorisation is used here too.
    pulse
        Force that causes the reference motion.
    n_modes
        Number of elastic free modes in the band, if no band is given.
    band
        Highest frequency [cycles per time unit of the body]; None: the frequency of mode n_modes.
    damping
        Ratio of every mode in the motion.
    motion
        A reference motion instead of the response to the pulse.
    n_expected
        Number of free modes that will be needed later; one search here costs less than two.

    Raises
    ------
    CompareError
        If no elastic mode lies in the band.
    """
    body = families.body
    if band is None:
        n_most = body.n_dof - families.Psi_R.shape[1]
        n_first = max(FIRST_SEARCH * n_modes, n_expected)
        if n_first <= n_most // 4:  # a preliminary search does not pay for a larger part of all modes
            families.free_modes(n_modes=n_first)
        band = float(families.free_modes(n_modes=min(n_modes, n_most)).frequencies[-1]) * (1 + 1e-9)
    modes = families.free_modes(ModeCount(cutoff=MODES_BEYOND * band))
    n_band = int((modes.frequencies <= band).sum())
    if n_band == 0:
        first = families.free_modes(n_modes=1).frequencies[0] / body.units.time
        raise CompareError(
            f"band: up to {band / body.units.time:g} Hz, but the first elastic mode of body {body.name!r} is at "
            f"{first:.6g} Hz; choose a band that holds modes"
        )
    response = reference_response(families, Ports.of_body(body), band)
    if motion is None:
        load = pulse.load(body, band=band, first=float(modes.frequencies[0]))
        motion = transient(families, load, cutoff=MODES_BEYOND * band / body.units.time, damping=damping)
    mass = moving_mass(families)
    Psi_A, Psi_H, Psi_L = (deformation(families, each.u) for each in static_responses(families))
    return ReferenceSolution(
        band=band,
        omega2=modes.omega2,
        rigid=families.free.N,
        Phi=modes.Phi[:, :n_band],
        Psi_A=Psi_A,
        Psi_H=Psi_H,
        Psi_L=Psi_L,
        moved=deformation(families, motion.columns),
        amplitudes=motion.amplitudes,
        t=motion.t,
        port_omega2=response.model.omega2,
        port_is_massive=response.model.is_massive,
        port_modes=response.model.modes,
        port_rigid=response.model.rigid,
        port_error=response.error,
        directions=mass.directions,
        held_mass=mass.total,
        mass=mass.rigid,
    )


def deformation(families: Families, u: Array) -> Array:
    """Return displacements without rigid-body motion, u - N Nᵀ M u; rigid-body motion would spoil their energy."""
    free = families.free
    return u - free.N @ (free.M_N.T @ u)


# The file -------------------------------------------------------------------------------------------------------------


def reference_digest(body: FEBody, *asked: object) -> str:
    """Return a digest of all input of the reference solution: matrices, dofs, interfaces, request."""
    digest = hashlib.sha256(repr((VERSION, body.units.name, asked)).encode())
    for matrix in (whole_matrix(body.K), whole_matrix(body.M)):
        for array in (matrix.data, matrix.indices, matrix.indptr):
            digest.update(np.ascontiguousarray(array).data)
    for case in body.load_cases:
        digest.update(case.name.encode())
        digest.update(np.ascontiguousarray(case.f).data)
    for interface in body.interfaces:
        digest.update(interface.name.encode())
        for part in (interface.nodes, interface.reference, interface.weights):
            digest.update(np.ascontiguousarray(part).data)
    for part in (body.nodes, body.dofs, body.b):
        digest.update(np.ascontiguousarray(part).data)
    return digest.hexdigest()


def write_full_model(path: Path, full: ReferenceSolution, digest: str) -> None:
    """Write a reference solution to a file; raise `OSError` if this fails."""
    buffer = BytesIO()
    arrays = {field.name: getattr(full, field.name) for field in fields(full)}
    np.savez(buffer, digest=np.frombuffer(bytes.fromhex(digest), np.uint8), **arrays)
    replace_file(path, buffer.getvalue())


def read_full_model(path: Path, digest: str) -> ReferenceSolution | None:
    """Return the reference solution with this digest; None if the file has another digest or is incomplete."""
    if not path.is_file():
        return None
    try:
        with np.load(BytesIO(path.read_bytes()), allow_pickle=False) as file:
            if bytes(file["digest"]).hex() != digest:
                return None
            return ReferenceSolution(**{field.name: file[field.name] for field in fields(ReferenceSolution)})
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        log.warning("%s: not a complete reference solution (%s); it is computed anew", path, error)
        return None
