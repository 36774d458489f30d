"""Small frames for tests."""

import numpy as np

import cms
import fe_models as fm

STEEL = fm.Material("steel", E=2.1e11, nu=0.3, rho=7850.0)
SI = cms.unit_system("m-kg-s")
RECTANGLE = fm.beams.Rectangle(0.02, 0.03)


def straight(n=8, section=RECTANGLE, length=1.0, *, interfaces=(), kind="rigid", material=STEEL, **options):
    """A straight beam along x of n elements; interfaces at "start" and "end" as asked for."""
    mesh = fm.beams.straight_line((0, 0, 0), (length, 0, 0), n)
    ends = [fm.beams.line_interface(mesh, name, fm.selections.NodeSet(name), kind=kind) for name in interfaces]
    keys = ("point_masses", "springs", "links")
    attached = {key: options.pop(key) for key in keys if key in options}
    return fm.beam_body(
        mesh, fm.beams.BeamProperty(section, material, **options), name="beam", units=SI, interfaces=ends, **attached
    )


def space_frame(seed=0):
    """A frame of five nodes in space with all sections, offsets, end offsets, point masses, a spring and a link."""
    rng = np.random.default_rng(seed)
    nodes = rng.uniform(-1, 1, (6, 3))
    lines = np.array([(0, 1), (1, 2), (2, 3), (3, 0), (0, 2), (1, 3)])
    shapes = [
        fm.beams.Circle(0.03),
        fm.beams.Tube(0.03, 0.004),
        fm.beams.Rectangle(0.03, 0.05),
        fm.beams.BoxSection(0.05, 0.08, 0.004, 0.006),
        fm.beams.ISection(0.1, 0.2, 0.006, 0.01),
        fm.beams.GeneralSection(1e-3, 2e-7, 3e-7, 1e-7, 8e-4, 7e-4, (0.02, -0.01)),
    ]
    mesh = fm.beams.LineMesh(
        nodes,
        lines,
        line_sets={str(k): np.array([k]) for k in range(6)},
        offsets=rng.uniform(-0.05, 0.05, (6, 2, 3)),
        orientations=rng.normal(size=(6, 3)),
    )
    properties = {
        str(k): fm.beams.BeamProperty(
            shape, STEEL, offset=tuple(rng.uniform(-0.02, 0.02, 2)), added_mass=float(k), rotary_inertia=k != 3
        )
        for k, shape in enumerate(shapes)
    }
    B = rng.normal(size=(3, 3))
    return fm.beam_body(
        mesh,
        properties,
        name="frame",
        units=SI,
        point_masses=[fm.beams.PointMass(4, 3.0, B @ B.T, rng.normal(size=3)), fm.beams.PointMass(2, 1.0, 0.1)],
        springs=[fm.beams.Spring((3, 4), 1e5 * np.ones(6), damping=10 * np.ones(6))],
        links=[fm.beams.RigidLink(1, (5,))],
    )


def supported_frequencies(body, fixed, k):
    """Lowest k frequencies of a body with some dofs held, by a dense pencil [Hz]."""
    import scipy.linalg as la

    free = np.setdiff1d(np.arange(body.n_dof), fixed)
    K, M = (A.toarray()[np.ix_(free, free)] for A in (body.K, body.M))
    omega2 = la.eigh(K, M, eigvals_only=True, subset_by_index=(0, k - 1))
    return np.sqrt(np.maximum(omega2, 0)) / (2 * np.pi)
