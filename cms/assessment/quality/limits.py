"""All thresholds of the quality checks, each defined once."""

from dataclasses import dataclass
from typing import Literal

__all__ = ["LIMITS", "Limit", "Verdict"]

Verdict = Literal["pass", "warn", "fail", "info"]


@dataclass(frozen=True)
class Limit:
    """Limit for a dimensionless value."""

    title: str  #: title of the record
    tolerance: float | None  #: largest value that passes; None: the value is only information
    failing: float | None  #: value above which the verdict is "fail"; between both it is "warn"; None: never fails
    action: str  #: remedy if the value does not pass

    def verdict(self, value: float) -> Verdict:
        """Return the verdict about a value; NaN fails."""
        if self.tolerance is None:
            return "info"
        if value <= self.tolerance:
            return "pass"
        return "fail" if self.failing is not None and not value <= self.failing else "warn"


REDUCE_AGAIN = "reduce the body again; the file contradicts itself"
LIMITS: dict[str, Limit] = {
    # A reduced body on its own: consistency of its data ----------------------------------------------------------
    "symmetry": Limit("symmetry of M, K, D and moments", 1e-9, 1e-6, REDUCE_AGAIN),
    "definiteness": Limit(
        "no negative mass, stiffness or damping", 1e-9, 1e-6,
        "look for a wrong sign or a mechanism in the model, then reduce again",
    ),
    "kinetic-energy": Limit(
        "kinetic energy of rigid and elastic motion is positive", 1e-9, 1e-6,
        "the mass moments do not belong to one body: a sign, a unit or an origin is wrong; reduce again",
    ),
    "modal-mass": Limit(
        "modal mass from the mass moments (M*)", 1e-8, 1e-4,
        "mass moments and modes belong to different bodies or have different units; reduce again",
    ),
    "frame-condition": Limit(
        "modes satisfy the body frame", 1e-8, 1e-4,
        "the frame named in the file is not that of its modes; reduce again in the wanted frame",
    ),
    "free-frequencies": Limit(
        "free-free frequencies recomputed from moments and stiffness", 1e-6, 1e-4,
        "a mass moment has a wrong sign, order or unit; reduce again",
    ),
    "inertia-tensor": Limit(
        "inertia tensor satisfies the triangle inequality", 1e-9, 1e-6,
        "check density, units and the origin of the inertia; no distribution of mass has this tensor",
    ),
    "gram": Limit(
        "moments are integrals over one mass distribution", 1e-9, 1e-6,
        "the moments contradict each other: a sign, an order or a unit is wrong; reduce again",
    ),
    "moments-shapes": Limit(
        "direction of the moments against masses at the kept nodes, (1 - cosine) / 2", 0.9, 0.95,
        "a moment has the wrong sign, or belongs to another mode; reduce again",
    ),
    "turned-loads": Limit(
        "geometric stiffness for a rotation against rotated loads", 1e-6, 1e-4,
        "moments or geometric stiffness have a wrong sign, order or unit; reduce again",
    ),
    "second-order": Limit(
        "geometric stiffness of interfaces against quadratic modes", 1e-6, 1e-4,
        "geometric stiffness or quadratic modes have a wrong sign, order or unit; reduce again",
    ),
    "rigid-interfaces": Limit(
        "members of rigid interfaces move rigidly", 1e-8, 1e-4,
        "the interface motions do not fit the modes at its nodes; reduce again",
    ),
    "interface-places": Limit(
        "reference points of interfaces are kept nodes and move with them", 1e-9, 1e-6,
        "position or motion of the interface are not those of its node; reduce again",
    ),
    "interface-motions": Limit(
        "independent motions of the interfaces that are missing", 0.0, None,
        "add constraint or attachment modes: joints at these interfaces meet a body that cannot follow",
    ),
    "energy-shares": Limit("energy shares of the sources sum to one", 1e-9, 1e-3, REDUCE_AGAIN),
    "labels": Limit(
        "labels and shares agree with the stored columns", 1e-9, 1e-3,
        "labels of modes do not agree with their columns; reduce again",
    ),
    "recovery-motions": Limit(
        "recovery rows of motions follow a rigid motion", 1e-6, 1e-4,
        "the rows belong to another position, frame or unit than their labels say; make the table again",
    ),
    "recovery-forces": Limit(
        "recovery rows of stress and forces in a rigid motion", 1e-6, 1e-3,
        "the rows belong to another body or are in axes of other nodes; make the table again",
    ),
    "recovery-shapes": Limit(
        "recovery rows of kept nodes and interfaces against the modes of the file", 1e-6, 1e-4,
        "rows and modes belong to different bodies, or differ in order or unit; make the table again",
    ),
    "driven-mass": Limit("mass that does not vibrate when one interface is driven", None, None, ""),
    "buckling": Limit(
        "unit loads divided by the loads that buckle the body", 1.0, None,
        "a unit load buckles the body: look for a wrong unit of modulus or density, or a part that is almost loose",
    ),
    "dropped-columns": Limit(
        "redundant columns that were dropped", None, None,
        "",
    ),
    "mesh-order": Limit(
        "lowest frequencies too high because of first-order cells", 0.02, None,
        "mesh with cells of second order, give bricks incompatible modes, or mesh finer",
    ),
    "inertia-terms": Limit(
        "inertia terms of the motion that are missing", 0.0, None,
        "import the body again with its full mass matrix, its nodal masses, or its mesh and density beside; or move it "
        "slowly, with leave_out_missing",
    ),
    "units": Limit(
        "implausible numbers among size, density and first frequency", 0.0, None,
        "do nodes, masses and stiffness have the units that the file names? If they are meant, nothing is wrong",
    ),
    "step-size": Limit(
        "highest frequency divided by lowest frequency", 1e4, None,
        "drop the stiffest modes, or take an implicit integrator with numerical damping (rho_inf below 1)",
    ),
    "damping": Limit(
        "share of modes without damping", None, None,
        "",
    ),
    "damping-told": Limit(
        "damping is at least the damping that the provenance names", 1e-9, 1e-6,
        "the damping was lost or changed after the reduction; reduce again",
    ),
    "scope": Limit("what the file alone cannot show", None, None, ""),
    # A mode set against its full model -----------------------------------------------------------------------------
    "same-body": Limit(
        "the reduced body is that of this model and mode set", 1e-6, 1e-6,
        "check with the job from which the file was made, or reduce again",
    ),
    "grounding": Limit(
        "stiffness does not resist rigid-body motion (K Psi_R = 0)", 1e-11, 1e-6,
        "release the body from the ground, or give the nodes with all their digits",
    ),
    "mass-properties": Limit(
        "mass, centre and inertia: full matrix against moments", 1e-9, 1e-4,
        "check the density, the mass matrix (lumped, rotated, scaled?) and the units",
    ),
    # all fields of the file in its own modes, `cms.assessment.quality.of_reduction.contents`
    "points": Limit(
        "nodes, numbers, sets and surface of the model", 1e-9, 1e-6,
        "the file's nodes are not those of the model: mesh, origin or axes differ; check with its own job",
    ),
    "frame": Limit(
        "modes satisfy the frame that the file names", 1e-6, 1e-4,
        "the frame named in the file is not that of its modes; reduce again in the wanted frame",
    ),
    "interfaces": Limit(
        "interfaces of the model: names, places, axes, members, motions", 1e-6, 1e-4,
        "an interface of the file is not that of the model; joints and forces there would be wrong: reduce again",
    ),
    "invariants": Limit(
        "all inertia invariants, 1C to 5C, of the model", 1e-8, 1e-4,
        "the moments are not those of the modes and the mass; reduce again from a body with its element model",
    ),
    "damping-matrix": Limit(
        "damping of the model and the job", 1e-6, 1e-4,
        "damping of file and job differ; reduce again, or check with the job from which the file was made",
    ),
    "load-cases": Limit(
        "load cases of the model", 1e-6, 1e-4,
        "a load case of the file is not that of the model; reduce again",
    ),
    "stress-modes": Limit(
        "stress of the modes", 1e-6, 1e-4,
        "stresses from this file would be wrong: components, units or nodes are mixed up; reduce again",
    ),
    "geometric-stiffness": Limit(
        "geometric stiffness of the unit loads", 1e-6, 1e-4,
        "loads would stiffen the body wrongly; reduce again, or leave it out (geometric_stiffness = false)",
    ),
    "quadratic-modes": Limit(
        "displacement of second order", 1e-6, 1e-4,
        "nodes would shorten wrongly; reduce again, or leave it out (quadratic_modes = false)",
    ),
    "kept-rotations": Limit(
        "rotations of kept nodes", 1e-6, 1e-4,
        "markers at these nodes would rotate wrongly; reduce again",
    ),
    "recovery-rows": Limit(
        "recovery tables of the job", 1e-5, 1e-3,
        "the tables are not those of this job and body; reduce again, or make them anew",
    ),
    "nodal-sums": Limit(
        "sums over the nodes, for a Buckens frame", 1e-6, 1e-4,
        "a Buckens frame made of this file would be wrong; reduce again",
    ),
    "error-estimates": Limit(
        "estimated errors in the file", 0.1, 0.5,
        "the file states errors that are not those of its modes; reduce again",
    ),
    "sources": Limit(
        "labels, shares and columns of the mode set", 1e-5, 1e-3,
        "labels and columns are not those of the modes; reduce again",
    ),
    "origin": Limit(
        "name, mode set and digests of what the file was made of", 0.0, None,
        "the file was made of something else; check with its own job, or reduce again",
    ),
    "frequency-error": Limit(
        "error of the free-free frequencies in the band", 0.01, 0.05,
        "keep more modes, or take a set with inertia relief or residual attachment modes",
    ),
    "mac": Limit(
        "modes in the band that the set does not recover (1 - MAC, mass-weighted)", 0.02, 0.2,
        "keep more modes, or lower the frequency band",
    ),
    "mac-nodal": Limit(
        "modes in the band that the set does not recover (1 - MAC, nodal)", 0.02, 0.2,
        "keep more modes, or lower the frequency band",
    ),
    "static-interface": Limit(
        "static response to loads on the interfaces, error in energy norm", 1e-6, 0.1,
        "add constraint or attachment modes for the loads listed",
    ),
    "static-inertia": Limit(
        "static response to rigid-body accelerations, error in energy norm", 0.05, None,
        "it matters if the body accelerates as a whole; a set with inertia relief, such as craig-bampton-ir, answers "
        "it exactly with at most six more columns, and more vibration modes answer it gradually",
    ),
    "static-load-cases": Limit(
        "static response to the load cases of the body, error in energy norm", 0.05, None,
        "add residual vectors of the load cases named, or keep more modes",
    ),
    "frequency-response": Limit(
        "frequency response at the interfaces, relative error over the band", 0.05, 0.3,
        "keep more modes, or lower the band",
    ),
    "residual-bound": Limit(
        "guaranteed distance of the frequencies in the band to true ones", 0.1, None,
        "keep more modes; the true error is at most this value and usually close to its square",
    ),
    "effective-mass": Limit(
        "effective mass with fixed interfaces that is missing in the modes", 0.1, None,
        "add fixed-interface modes or inertia-relief modes, or accept it if the missing direction is not driven",
    ),
    "conditioning": Limit(
        "condition of the mode set's columns", 1e8, 1e13,
        "leave out columns that are nearly combinations of others; digits are lost in the reduced matrices",
    ),
    "interface-stiffening": Limit(
        "change of frequencies between rigid and distributing interfaces", 0.05, None,
        "the real stiffness lies between RBE2 and RBE3: choose by the stiffness of the joint, or enlarge the interface",
    ),
    # A received body against a full model of the same part --------------------------------------------------------
    "model-mass": Limit(
        "mass, centre and inertia: full model against the body", 1e-3, 1e-2,
        "look for masses that only one of them has (cards of the deck that are left out), and for units and densities",
    ),
    "band-asked": Limit(
        "highest frequency of interest over that which the body is good for", 1.000001, 1.000001,
        "reduce with more modes, or ask for a lower band",
    ),
    "mesh-error": Limit(
        "lowest frequencies too high because of the mesh, estimated", 0.02, None,
        "mesh finer; if the cells are of first order, cells of second order also help",
    ),
    # Measured modes against a model --------------------------------------------------------------------------------
    "test-partners": Limit(
        "share of the measured modes without a partner in the model", 0.0, 0.99,
        "compare the shape with the most similar one of the model; possible causes are a misplaced point, a missing "
        "part of the model, and too narrow a window for pairs",
    ),
    "test-frequency": Limit(
        "frequencies of the model against the test", 0.02, 0.05,
        "let the test update the job ([update]), or check masses, joints and supports of both",
    ),
    "test-mac": Limit(
        "measured shapes that the model does not have (1 - MAC)", 0.1, 0.3,
        "look at the points with the least COMAC: a sensor may be rotated or exchanged, or the model is wrong there",
    ),
    "test-orthogonality": Limit(
        "coupling of two measured shapes by the mass of the model", 0.1, None,
        "measure at more points, or separate close modes: the measured shapes are mixed",
    ),
    "left-out": Limit(
        "kinds of cards of the deck that carry mass or stiffness and are left out", 0.0, None,
        "decide for each card whether the result is valid without it",
    ),
    "deformation-error": Limit(
        "deformation of the reference motion outside the mode set", 0.05, None,
        "add modes that carry the load: inertia relief, attachment or load-case residual vectors",
    ),
}  # fmt: skip
