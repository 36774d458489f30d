"""Estimated mesh error of the free frequencies of a job from its one mesh, and where this mesh is too coarse.

eta² of an element of size h falls with h^(2 p + d), with p the order of the element and d = 3, or 2 for shells. If the
error e of a frequency may be 2 e lambda = sum eta² at most, and the n elements share it evenly, the size of an element
is too large by the factor (eta² n / (2 e lambda))^(1 / (2 p + d)).
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cms.assessment.quality.record import QualityRecord, information, judge
from cms.assessment.rendering import Drawing, Scene, Surface, render_picture
from cms.assessment.report.view import view_axes
from cms.errors import JobError
from cms.modes.families.families import Families
from cms.modes.mode_sets.free_interface import normal_modes
from cms.reduction.basis.free_basis import free_basis
from cms.reduction.mesh_error import MeshErrors, mesh_errors
from fe_models.body.fe_body import FEBody
from fe_models.elements.recovery.mesh_error import powers_of_size, surface_elements
from fe_models.foundation.arrays import Array

__all__ = ["RATE", "MeshEstimate", "draw_oversize", "mesh_estimate"]

RATE = 2.0  #: assumed power of the element size with which the error of a frequency falls, if it is not measured


@dataclass(frozen=True, eq=False)
class MeshEstimate:
    """Free frequencies of a body, and their estimated errors by its mesh."""

    body: FEBody
    frequencies: Array  #: elastic free frequencies, ascending, (n,) [Hz]
    errors: MeshErrors

    @property
    def worst(self) -> float:
        """Size of the largest estimated error; NaN: none is known."""
        known = np.abs(self.errors.frequency[~np.isnan(self.errors.frequency)])
        return float(known.max(initial=0.0)) if len(known) else float("nan")

    def size_factor(self, error: float, rate: float = RATE) -> float:
        """Return the factor of the element size that makes the largest error equal to `error`."""
        return float((error / self.worst) ** (1 / rate))

    def judged(self, error: float, rate: float = RATE, size: float | None = None) -> QualityRecord:
        """Return the verdict about the largest error, with the element size for the wanted error as reason.

        Parameters
        ----------
        error
            Largest error of the frequencies that passes.
        rate
            Power of the element size with which the error falls.
        size
            Element size of this mesh, if the mesh has one.
        """
        if np.isnan(self.worst):
            return information("mesh-error", self.errors.method)
        factor, k = self.size_factor(error, rate), int(np.nanargmax(np.abs(self.errors.frequency)))
        return judge(
            "mesh-error", self.worst,
            f"mode {k + 1} of {len(self.frequencies)} has the largest error, {100 * self.worst:.2g} %; for "
            f"{100 * error:.2g} %, elements {factor:.2g} times as large"
            + ("" if size is None else f", size {size * factor:.3g}")
            + f", if the error falls with the size to the power {rate:.2g}",
            {"error": self.errors.frequency}, tolerance=error,
        )  # fmt: skip

    def oversize(self, error: float) -> Array:
        """Return for each surface triangle by which factor its element is too large for this error, (n_tri,).

        Raises
        ------
        JobError
            If the errors of the elements are not known, or the body has no surface.
        """
        model, of_cells, surface = self.body.element_model, self.errors.of_cells, self.body.surface
        if of_cells is None or not len(surface):
            raise JobError(
                f"converge: body {self.body.name!r}: a picture needs a surface and errors of its elements; got "
                f"{len(surface)} triangles, and the error of the mesh: {self.errors.method}"
            )
        eta2 = np.abs(of_cells).max(axis=1)
        factor = (eta2 * len(eta2) / (2 * error)) ** (1 / powers_of_size(model))
        return np.append(factor, 0.0)[surface_elements(model)]  # 0 where no error is known


def mesh_estimate(body: FEBody, n_modes: int) -> MeshEstimate:
    """Compute the lowest elastic frequencies of a free body, and estimate their errors by its mesh."""
    bare = replace(body, load_cases=())
    with Families(bare) as families:
        modes = normal_modes(families, n_modes)
        basis = free_basis(bare, modes, families)
        frequencies = basis.frequencies(body.units.time)[:n_modes]
        errors = mesh_errors(bare, basis, len(frequencies))
    return MeshEstimate(body, frequencies, errors)


def draw_oversize(estimate: MeshEstimate, error: float, path: Path) -> Drawing:
    """Draw the surface, coloured by the factor by which its elements are too large for an error of the frequencies.

    Raises
    ------
    JobError
        As `MeshEstimate.oversize`.
    RenderError
        If the file cannot be written.
    """
    body, values = estimate.body, estimate.oversize(error)
    triangles = body.surface
    corners = body.nodes[triangles].reshape(-1, 3)  # each triangle has its own corners, so that colours do not blend
    direction, up = view_axes(body.nodes[np.unique(triangles)])
    scene = Scene(
        surfaces=(Surface(np.arange(len(corners)).reshape(-1, 3), corners, np.repeat(values, 3), has_edges=False),),
        title=f"{body.name}: where the mesh is too coarse",
        captions=(
            f"largest error of {len(estimate.frequencies)} frequencies: {100 * estimate.worst:.2g} %, "
            f"wanted: {100 * error:.2g} %",
            "element size over the size for the wanted error, if stress is smooth: above 1 too coarse, below 1 finer",
        ),
        scalar_title="size over wanted size",
        direction=direction,
        up=up,
    )
    return render_picture(scene, path)
