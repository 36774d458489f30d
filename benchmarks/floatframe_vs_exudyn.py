"""Time per step against exudyn's ObjectFFRFreducedOrder, one body and a chain of ten, with 8, 20 and 50 modes.

    python -W ignore benchmarks/floatframe_vs_exudyn.py [steps] [steps of the peer]

Both sides get the same reduced body: 200 point masses, M-orthonormal shapes of 4 to 4000 rad/s, hung at one of its
points or in a chain of spherical joints; nothing but the spin of the start acts (gravity would act on the undeformed
centre of mass there). h = 1e-3, generalized-alpha with rho_inf = 0.8 on both sides.

exudyn 1.13.6: exudynFast, rotation vector node, one thread, modified Newton; of the solvers EXUdense and EigenSparse
the faster. Its time per step is the difference of two runs, one twice as long, so that neither assembly nor start
count. Times are processor time of the process, best of three (here: five). "tip": largest difference of the two tips
after 0.2 s; "half steps": how far each tip moves when its own step is halved.
"""

import sys
import time
from pathlib import Path

import numpy as np
import scipy.sparse as sp

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from benchmarks.floatframe_step import m_orthonormal_body, measure
from floatframe import GROUND, FlexibleBody, GeneralizedAlpha, Marker, SphericalJoint, System, integrate
from floatframe.results.place_motion import interface_motion

H, T_TIP, SPIN = 1e-3, 0.2, (0.3, 1.0, 0.4)


def places(part, n_bodies):
    """Return the positions of the mesh origins in a straight chain, and the point where it hangs."""
    first, second = part.interface("end_b").position, part.interface("end_a").position
    return [k * (second - first) - first for k in range(n_bodies)]


def own(part, n_bodies):
    bodies, joints, previous = [], [], GROUND
    for k, x in enumerate(places(part, n_bodies)):
        bodies.append(FlexibleBody(f"b{k}", part, position=x, velocity=np.cross(SPIN, x), omega_B=SPIN))
        joints.append(SphericalJoint(f"j{k}", previous, Marker(f"b{k}", "end_b")))
        previous = Marker(f"b{k}", "end_a")
    return System(bodies, joints, [])


def own_tip(system, part, n_bodies, h):
    motion = integrate(system, GeneralizedAlpha(0.8), T_TIP, h, output_every=round(T_TIP / h))
    return interface_motion(motion, f"b{n_bodies - 1}", part, "end_a").position[-1]


class Mesh:
    """What exudyn's interface asks of a finite element model."""

    def __init__(self, part):
        self.postProcessingModes = {}
        self.part, n = part, len(part.nodes)
        self.mass = np.repeat(node_masses(part), 3)
        self.modeBasis = {"matrix": np.ascontiguousarray(part.Phi.reshape(3 * n, -1))}

    def GetNodePositionsAsArray(self):
        """Return the places of the points."""
        return self.part.nodes

    def GetSurfaceTriangles(self):
        """Return no surface."""
        return []

    GetSurfaceTriangles6 = GetSurfaceTriangles

    def GetMassMatrix(self, sparse=True):
        """Return the masses of the points."""
        return sp.diags_array(self.mass, format="csr")

    def GetStiffnessMatrix(self, sparse=True):
        """Return nothing; the reduced stiffness is put in later."""
        return sp.csr_array((len(self.mass),) * 2)


def node_masses(part):
    """Return the masses of the points as the benchmark of a step draws them."""
    from tests.floatframe.point_masses import random_point_masses

    points = random_point_masses(part.n_q, 3, n_points=200, softness=1.0)
    assert np.array_equal(points.c, part.nodes)
    return points.m


def peer(part, n_bodies):
    sys.exudynFast = True  # the peer's way to ask for its fast module
    import exudyn as exu
    from exudyn.FEM import ObjectFFRFreducedOrderInterface

    items = exu.itemInterface

    container = exu.SystemContainer()
    mbs = container.AddSystem()
    data = ObjectFFRFreducedOrderInterface(Mesh(part), rigidBodyNodeType="NodeType.RotationRotationVector")
    data.stiffnessMatrixReduced = np.array(part.K)
    data.massMatrixReduced = np.array(part.M)
    end_a, end_b = (int(part.interface(name).members[0]) for name in ("end_a", "end_b"))
    ground = mbs.AddObject(items.ObjectGround(referencePosition=[0, 0, 0]))
    previous = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=ground, localPosition=[0, 0, 0]))
    tip = None
    for x in places(part, n_bodies):
        made = data.AddObjectFFRFreducedOrderWithUserFunctions(
            exu, mbs, positionRef=list(x), initialVelocity=list(np.cross(SPIN, x)), initialAngularVelocity=list(SPIN)
        )
        number = made["oFFRFreducedOrder"]
        if np.any(part.D):
            damping = exu.MatrixContainer()
            damping.SetWithDenseMatrix(np.array(part.D), useDenseMatrix=False)
            mbs.SetObjectParameter(number, "dampingMatrixReduced", damping)

        def at(node, number=number):
            return mbs.AddMarker(
                items.MarkerSuperElementPosition(bodyNumber=number, meshNodeNumbers=[node], weightingFactors=[1.0])
            )

        mbs.AddObject(items.ObjectJointSpherical(markerNumbers=[previous, at(end_b)]))
        previous = at(end_a)
        tip = number
    mbs.Assemble()

    def settings(h, n_steps, solver):
        made = exu.SimulationSettings()
        integration = made.timeIntegration
        integration.endTime, integration.numberOfSteps = h * n_steps, n_steps
        integration.verboseMode = 0
        integration.generalizedAlpha.spectralRadius = 0.8
        integration.newton.useModifiedNewton = True
        made.linearSolverType = getattr(exu.LinearSolverType, solver)
        made.parallel.numberOfThreads = 1
        made.solution.file.write = made.solution.sensors.active = False
        return made

    def run(h, n_steps, solver):
        start = time.process_time()
        if not mbs.SolveDynamic(settings(h, n_steps, solver), updateInitialValues=False, storeSolver=False):
            raise RuntimeError("the peer's run failed")
        seconds = time.process_time() - start
        r = mbs.GetObjectOutputSuperElement(tip, exu.OutputVariableType.Position, end_a)
        return seconds, np.array(r)

    return run


def measure_peer(run, n_steps):
    """Return the time per step of the faster solver, and its name."""
    best = {}
    for solver in ("EXUdense", "EigenSparse"):
        short = min(run(H, n_steps, solver)[0] for _ in range(3))
        long = min(run(H, 2 * n_steps, solver)[0] for _ in range(3))
        best[solver] = (long - short) / n_steps
    name = min(best, key=best.get)
    return best[name], name


def both(n_bodies, n_q, n_own, n_peer):
    """Return our time of a step and the peer's with its solver, the body, and what runs either side."""
    part = m_orthonormal_body(n_q, 3)
    system, run = own(part, n_bodies), peer(part, n_bodies)
    ours = measure([system], n_own, 5)[0][0]
    theirs, solver = measure_peer(run, n_peer if n_bodies == 1 else max(n_peer // 8, 10))
    return ours, theirs, solver, part, system, run


def figures(short):
    """Return what the watch keeps."""
    told = {}
    for n_bodies in (1, 10):
        for n_q in (8, 20) if short else (8, 20, 50):
            ours, theirs, *_ = both(n_bodies, n_q, 2000, 800)
            told[f"against exudyn, bodies: {n_bodies}, modes: {n_q}, speedup"] = theirs / ours
            told[f"a step, bodies: {n_bodies}, modes: {n_q} [µs]"] = 1e6 * ours
    return told


def main():
    n_own = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    n_peer = int(sys.argv[2]) if len(sys.argv) > 2 else 400
    print("bodies  modes   floatframe       exudyn   ratio  solver         tip: apart  half steps")
    for n_bodies in (1, 10):
        for n_q in (8, 20, 50):
            ours, theirs, solver, part, system, run = both(n_bodies, n_q, n_own, n_peer)
            n_tip = round(T_TIP / H)
            own_r, own_fine = (own_tip(system, part, n_bodies, h) for h in (H, H / 2))
            peer_r, peer_fine = run(H, n_tip, solver)[1], run(H / 2, 2 * n_tip, solver)[1]
            apart = np.abs(own_r - peer_r).max()
            steps = f"{np.abs(own_r - own_fine).max():.1e} {np.abs(peer_r - peer_fine).max():.1e}"
            row = f"{n_bodies:6d} {n_q:6d} {ours * 1e6:9.1f} us {theirs * 1e6:9.0f} us {theirs / ours:7.1f}"
            print(f"{row}  {solver:12s} {apart:12.1e}  {steps}", flush=True)


if __name__ == "__main__":
    main()
