"""Exudyn: the archive of its ObjectFFRFreducedOrderInterface, read and written, and a script that makes a body."""

import io
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cms.body.reduced_body import ReducedBody
from cms.errors import ForeignBodyError
from cms.exchange.exporters.nodes import reference_row
from cms.exchange.exporters.writer import Request, WrittenFiles
from cms.exchange.importers.integrals import moments_of_invariants
from cms.exchange.importers.modal_body import ForeignInterface, ModalBody
from fe_models.foundation.arrays import Array, tilde

__all__ = ["is_exudyn", "make_exudyn", "read_exudyn"]


# Exudyn: the archive of its ObjectFFRFreducedOrderInterface, and a script that makes a body from it -------------------


#: angular velocity in the script, relative to the lowest frequency; multiplied by 1, 2, 3 for the three axes
SPEED = 0.05
BENT = 0.01  #: initial displacement in the script divided by the size of the body
FILE_VERSION = 1  #: version of the archive in exudyn 1.9 to 1.13


def make_exudyn(request: Request) -> WrittenFiles:
    """Return the archive FILE.npz and the script FILE.py."""
    archive = request.path.with_suffix(".npz")
    script = request.path.with_suffix(".py")
    image = io.BytesIO()
    np.savez(image, **archive_of(request.body), floatframe_header=np.array(request.header()))
    notes = tuple(f"interface {each.name}: {members_words(each)}" for each in request.body.interfaces)
    return WrittenFiles({archive: image.getvalue(), script: script_of(request, archive).encode("utf-8")}, notes)


def archive_of(body: ReducedBody) -> dict[str, Any]:
    """Return the arrays of ObjectFFRFreducedOrderInterface by name, and arrays of this project with a prefix.

    x~ is the skew matrix of a vector. All integrals are over mass. Shapes are placed side by side in blocks of one or
    three columns:

        mPhitTPsi = 1C,  mPhitTPsiTilde = [1C_k~],  mXRefTildePsi = int c~^T phi_k = -2C
        mXRefTildePsiTilde = int c~^T phi_k~ = 3C_k,  mPsiTildePsi = int phi_k~^T phi_l = 4C_kl,
        mPsiTildePsiTilde = int phi_k~^T phi_l~ = 5C_kl,  inertiaLocal = J0,  chiU = S / m
    """
    moments, n = body.moments, body.n_q
    stress: dict[str, Any] = {}
    if body.stress is not None:  # rows are nodes; columns are six components of the first mode, six of the second, ...
        rows = np.asarray(body.stress).transpose(0, 2, 1).reshape(len(body.nodes), 6 * n)
        stress = {"matrix": rows, "outputVariableType": "OutputVariableType.StressLocal"}
    post = np.empty((), dtype=object)  # exudyn extracts this dict with .item()
    post[()] = stress
    ours: dict[str, Any] = {
        "floatframe_damping": body.D,
        "floatframe_origin": body.frame.origin,
        "floatframe_axes": body.frame.axes,
        "floatframe_names": np.array([interface.name for interface in body.interfaces], dtype=str),
        "floatframe_positions": np.array([interface.position for interface in body.interfaces]).reshape(-1, 3),
        "floatframe_triads": np.array([interface.triad for interface in body.interfaces]).reshape(-1, 3, 3),
        "floatframe_reference": np.array([-1 if at is None else at for at in references(body)], dtype=np.int64),
        "floatframe_Psi": np.array([interface.Psi for interface in body.interfaces]).reshape(-1, 6, n),
    }
    for k, interface in enumerate(body.interfaces):
        ours[f"floatframe_members_{k}"] = interface.members
    if body.numbering.nodes.size:  # numbers in the user's mesh, -1 for nodes without a number
        ours["floatframe_node_numbers"] = body.numbering.nodes
    return {
        "modeBasis": body.Phi.reshape(-1, n),
        "trigList": body.surface,
        "postProcessingModes": post,
        "massMatrixReduced": body.M,
        "stiffnessMatrixReduced": body.K,
        "infoList": np.array([n, len(body.nodes), 3, 4, 7, 7 + n]),
        "rigidBodyNodeType": np.array("NodeType.RotationEulerParameters"),
        "xRef": body.nodes.reshape(-1),
        "inertiaLocal": moments.J0,
        "Mtt": moments.m * np.eye(3),
        "totalMass": np.array(moments.m),
        "chiU": moments.center_of_mass,
        "chiUtilde": tilde(moments.center_of_mass),
        "mPsiTildePsi": moments.C4.transpose(0, 2, 1).reshape(3 * n, n),
        "mPsiTildePsiTilde": moments.C5.transpose(0, 2, 1, 3).reshape(3 * n, 3 * n),
        "mPhitTPsi": moments.C1,
        "mPhitTPsiTilde": side_by_side(tilde(moments.C1.T)),
        "mXRefTildePsi": -moments.C2,
        "mXRefTildePsiTilde": side_by_side(moments.C3),
        "fileVersion": np.array(FILE_VERSION),
        "type": np.array("ObjectFFRFreducedOrderInterface"),
        **ours,
    }


def references(body: ReducedBody) -> list[int | None]:
    """Return the kept node at the reference point of each interface; None if there is none."""
    return [reference_row(body, k) for k in range(len(body.interfaces))]


def side_by_side(matrices: Array) -> Array:
    """Return matrices (n, 3, 3) as one matrix (3, 3 n), side by side."""
    return np.asarray(matrices).transpose(1, 0, 2).reshape(3, -1)


def members_words(interface: Any) -> str:
    """Describe to which object the script attaches the marker of an interface."""
    return f"marker of {len(interface.members)} mesh nodes"


SCRIPT = '''"""{title}

{header}

As a module: `body = add_body(mbs)` adds the body, `marker(mbs, body, "{first}")` a marker of an interface;
`mesh_node(12)` is the mesh node with the number 12 in the mesh it was made from, for sensors.
As a script: the free body, placed as its mesh, bent into its first mode by Q_0, turns about the mesh origin with the
angular velocity OMEGA. In floatframe the same motion is

    body = ff.FlexibleBody("body", cms.read(FILE, units="{units}"), omega_B=OMEGA, q=Q_0, stiffening=False)
    system = ff.System([body], units=body.reduced.units)
    motion = ff.integrate(system, ff.GeneralizedAlpha(0.9), t_end=END, h=END / STEPS)
    motion.body("body").r[-1], motion.body("body").q[-1]
"""

import os

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from exudyn.FEM import ObjectFFRFreducedOrderInterface

ARCHIVE = os.path.join(os.path.dirname(os.path.abspath(__file__)), {archive!r})
INTERFACES = {interfaces!r}
OMEGA = np.array([1.0, 2.0, 3.0]) * {speed!r}
Q_0 = np.array([{start!r}] + [0.0] * {others})
END, STEPS = {end!r}, 400


def add_body(mbs, **options):
    """Add the body to a MainSystem; options as of AddObjectFFRFreducedOrder (positionRef, gravity, ...)."""
    cms = ObjectFFRFreducedOrderInterface()
    cms.LoadFromFile(ARCHIVE, mode="NPZ")
    body = cms.AddObjectFFRFreducedOrder(mbs, **options)
    with np.load(ARCHIVE) as archive:
        damping = archive["floatframe_damping"]
    if damping.any():
        matrix = exu.MatrixContainer()
        matrix.SetWithDenseMatrix(damping, useDenseMatrix=False)
        mbs.SetObjectParameter(body["oFFRFreducedOrder"], "dampingMatrixReduced", matrix)
    return body


def marker(mbs, body, name, rigid=True):
    """Add a marker at an interface: its reference point, or mean place and rotation of its members if it is rigid."""
    with np.load(ARCHIVE) as archive:
        k = archive["floatframe_names"].tolist().index(name)
        members = archive["floatframe_members_%d" % k].tolist()
        if not rigid and archive["floatframe_reference"][k] >= 0:
            members = [int(archive["floatframe_reference"][k])]
        if rigid and len(members) < 3:
            raise ValueError("marker: %s has %d nodes, a rigid one needs 3: rigid=False" % (name, len(members)))
        offset = archive["floatframe_positions"][k] - archive["xRef"].reshape(-1, 3)[members].mean(axis=0)
    kind = eii.MarkerSuperElementRigid if rigid else eii.MarkerSuperElementPosition
    place = {{"offset": offset}} if rigid else {{}}
    weights = np.full(len(members), 1 / len(members))
    return mbs.AddMarker(kind(
        bodyNumber=body["oFFRFreducedOrder"], meshNodeNumbers=members, weightingFactors=weights, **place))


def mesh_node(number):
    """Return which mesh node of the body has a number of the mesh that it was made from."""
    with np.load(ARCHIVE) as archive:
        if "floatframe_node_numbers" not in archive:
            raise ValueError("mesh_node: the body knows no numbers of its mesh")
        rows = np.flatnonzero(archive["floatframe_node_numbers"] == number)
    if len(rows) == 0:
        raise ValueError("mesh_node: the body keeps no node %s" % number)
    return int(rows[0])


def main():
    """Let the free body turn and swing, and print where its frame and its modal coordinates are at the end."""
    with np.load(ARCHIVE) as archive:
        origin, axes = archive["floatframe_origin"], archive["floatframe_axes"]
    system = exu.SystemContainer()
    mbs = system.AddSystem()
    body = add_body(mbs, positionRef=origin, rotationMatrixRef=axes, initialVelocity=np.cross(OMEGA, origin),
                    initialAngularVelocity=OMEGA)
    mbs.SetNodeParameter(body["nGenericODE2"], "initialCoordinates", Q_0.tolist())
    for name in INTERFACES:
        marker(mbs, body, name, rigid=False)
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = END
    settings.timeIntegration.numberOfSteps = STEPS
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.timeIntegration.generalizedAlpha.computeInitialAccelerations = True
    settings.timeIntegration.newton.relativeTolerance = 1e-10
    settings.solution.file.write = False
    mbs.SolveDynamic(settings)
    r = mbs.GetNodeOutput(body["nRigidBody"], exu.OutputVariableType.Position)
    q = np.atleast_1d(mbs.GetNodeOutput(body["nGenericODE2"], exu.OutputVariableType.Coordinates))
    print("time:", END)
    print("position of the body frame:", *r)
    print("modal coordinates:", *q)


if __name__ == "__main__":
    main()
'''


def script_of(request: Request, archive: Path) -> str:
    """Return the text of the script."""
    body = request.body
    names = [interface.name for interface in body.interfaces]
    slowest = body.frequencies[np.isfinite(body.frequencies) & (body.frequencies > 0)].min(initial=np.inf)
    slowest = float(f"{slowest:.3g}") if np.isfinite(slowest) else 1.0
    size, largest = np.linalg.norm(np.ptp(body.nodes, axis=0)), np.linalg.norm(body.Phi[:, :, 0], axis=1).max()
    start = float(f"{BENT * size / largest:.3g}") if largest > 0 else 0.0
    lines = [line.replace("\\", "/").replace('"""', "'''") for line in request.header()]
    return SCRIPT.format(
        title=lines[0], header="\n".join(lines[1:]), first=names[0] if names else "NAME", units=body.units.name,
        archive=archive.name, interfaces=names, speed=float(f"{SPEED * slowest:.3g}"), start=start, others=body.n_q - 1,
        end=float(f"{0.7 / slowest:.3g}"),
    )  # fmt: skip


# bodies of Exudyn: the archive of its ObjectFFRFreducedOrderInterface -------------------------------------------------


NEEDED = (
    "modeBasis", "massMatrixReduced", "stiffnessMatrixReduced", "xRef", "inertiaLocal", "totalMass", "chiU",
    "mPhitTPsi", "mXRefTildePsi", "mXRefTildePsiTilde", "mPsiTildePsi", "mPsiTildePsiTilde",
)  # fmt: skip
LARGEST = 1_000_000_000  #: largest size of an array that is read [bytes]


def is_exudyn(path: Path, head: bytes) -> bool:
    """Return whether a file is an archive with the arrays of a reduced body of Exudyn."""
    if path.suffix.lower() != ".npz" or not zipfile.is_zipfile(path):
        return False
    with zipfile.ZipFile(path) as archive:
        return {"modeBasis.npy", "mPsiTildePsi.npy"} <= set(archive.namelist())


def read_exudyn(files: Sequence[Path], name: str, places: Mapping[int, Array]) -> ModalBody:
    """Read a reduced body of Exudyn; node numbers begin at 0 as in Exudyn. Pickled objects are never opened.

    mPhitTPsi = 1C, mXRefTildePsi = -2C, mXRefTildePsiTilde = [3C_k], mPsiTildePsi = 4C, mPsiTildePsiTilde = 5C

    Raises
    ------
    ForeignBodyError
        If an array is missing or of another shape, or the archive is damaged.
    """
    path = files[0]
    if len(files) > 1:
        raise ForeignBodyError(f"{path}: expected one archive of Exudyn, got {len(files)} files")
    with zipfile.ZipFile(path) as archive:
        too_large = [entry.filename for entry in archive.infolist() if entry.file_size > LARGEST]
        if too_large:
            raise ForeignBodyError(f"{path}: {too_large[0]} says it holds more than {LARGEST} bytes; is it damaged?")
    with np.load(path, allow_pickle=False) as archive:

        def read(key: str, *shape: int) -> Array:
            if key not in archive:
                raise ForeignBodyError(f"{path}: array {key!r} is missing")
            values = archive[key]
            if values.dtype.kind not in "fiu" or values.size != int(np.prod(shape)):
                raise ForeignBodyError(
                    f"{path}: array {key!r}: expected numbers of shape {shape}, got {values.dtype} {values.shape}"
                )
            return np.asarray(values, dtype=float).reshape(shape)

        for key in NEEDED:
            if key not in archive:
                raise ForeignBodyError(f"{path}: array {key!r} is missing; save it with exudyn 1.9 or newer")
        n = archive["stiffnessMatrixReduced"].shape[-1]
        n_nodes = archive["xRef"].size // 3
        if not n or not n_nodes:
            raise ForeignBodyError(f"{path}: expected modes and nodes, got {n} and {n_nodes}")
        m, M = float(read("totalMass")), read("massMatrixReduced", n, n)
        moments, notes = moments_of_invariants(
            str(path),
            m,
            m * read("chiU", 3),
            read("inertiaLocal", 3, 3),
            read("mPhitTPsi", 3, n),
            -read("mXRefTildePsi", 3, n),
            M,
            C3=read("mXRefTildePsiTilde", 3, n, 3).transpose(1, 0, 2),
            C4=read("mPsiTildePsi", n, 3, n).transpose(0, 2, 1),
            C5=read("mPsiTildePsiTilde", n, 3, n, 3).transpose(0, 2, 1, 3),
        )
        interfaces: list[ForeignInterface] = []
        if "floatframe_names" in archive:
            names = archive["floatframe_names"].tolist()
            positions, Psi = read("floatframe_positions", len(names), 3), read("floatframe_Psi", len(names), 6, n)
            triads = read("floatframe_triads", len(names), 3, 3)
            interfaces = [
                ForeignInterface(str(each), archive[f"floatframe_members_{k}"], positions[k], triads[k], Psi[k])
                for k, each in enumerate(names)
            ]
        surface = np.asarray(archive["trigList"], dtype=np.int64) if "trigList" in archive else np.zeros((0, 3))
        return ModalBody(
            name=name,
            M=M,
            K=read("stiffnessMatrixReduced", n, n),
            D=read("floatframe_damping", n, n) if "floatframe_damping" in archive else None,
            moments=moments,
            node_numbers=np.arange(n_nodes),
            nodes=read("xRef", n_nodes, 3),
            Phi=read("modeBasis", n_nodes, 3, n),
            surface=surface.reshape(-1, 3).astype(np.int64),
            interfaces=tuple(interfaces),
            program="Exudyn",
            provenance={
                "source": "Exudyn, ObjectFFRFreducedOrderInterface",
                **{f"note {k + 1}": note for k, note in enumerate(notes)},
            },
        )
