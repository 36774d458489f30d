"""OpenFAST's ExtPtfm: a superelement with one interface node and its fixed-interface modes (format FlexASCII)."""

from collections.abc import Iterator, Mapping

import numpy as np

from cms.errors import ExportError
from cms.exchange.exporters.writer import Made, Request
from cms.reduction.interface_model import InterfaceModel, interface_model
from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted

__all__ = ["make_ext_ptfm"]

LAST_TIME = 10000.0  #: the loads are constant from zero to this time [s]


def make_ext_ptfm(request: Request) -> Made:
    """Return the file: mass, stiffness and damping (x, y, z, rotations about them, modes), and constant loads.

    Raises
    ------
    ExportError
        If the body does not have exactly one interface with six dofs, or a load case is unknown.
    """
    body = request.body
    if len(body.interfaces) != 1:
        names = ", ".join(interface.name for interface in body.interfaces)
        raise ExportError(
            f"export to ext_ptfm: the format has one interface node, body {body.name!r} has {len(body.interfaces)} "
            f"({names}); reduce it with the one that carries the tower"
        )
    model = interface_model(body)
    if model.n_boundary != 6:
        raise ExportError(
            f"export to ext_ptfm: interface {body.interfaces[0].name!r} has {model.n_boundary} dofs, the format has "
            "six; make it rigid or distributing"
        )
    place = " ".join(f"{x:.9g}" for x in model.nodes[0].position)
    notes = [f"interface {body.interfaces[0].name}: platform reference point, at {place} in the mesh"]
    if not body.is_held:
        notes.append(
            "the body is free: no foundation is in its stiffness; reduce it held (`held`) where it is built in"
        )
    f = load_of(model, request.loads)
    amplitudes = {case.name: request.loads.get(case.name, 0.0) for case in body.load_cases}
    notes += [f"static load {name}, amplitude {amplitude:g}" for name, amplitude in amplitudes.items()]
    text = "\n".join(lines_of(model, f, request)) + "\n"
    return Made({request.path: text.encode("ascii")}, tuple(notes))


def load_of(model: InterfaceModel, wanted: Mapping[str, float]) -> Array:
    """Return the sum of load cases, each times its amplitude, (n,)."""
    f = np.zeros(len(model.K))
    names = [case.name for case in model.body.load_cases]
    for name, amplitude in wanted.items():
        if name not in names:
            raise ExportError(f"export to ext_ptfm: load: no load case {quoted(name)}{nearest(name, names)}")
        f += amplitude * model.loads[:, names.index(name)]
    return f


def lines_of(model: InterfaceModel, f: Array, request: Request) -> Iterator[str]:
    """Yield the lines of the file."""
    n = len(model.K)
    header = request.header()
    yield f"!{'; '.join(header)}"
    yield "!Flex 5 format"
    yield f"!Dimension: {n}"
    yield f"!Time increment in simulation: {LAST_TIME:.1f}"
    yield f"!Total simulation time in file: {LAST_TIME:.1f}"
    for name, unit, matrix in (
        ("Mass", "kg,m", model.M),
        ("Stiffness", "N,m", model.K),
        ("Damping", "N,m,kg", model.D),
    ):
        yield f"!{name} Matrix (Units ({unit}))"
        yield f"!Dimension: {n}"
        yield from (row_of(row) for row in matrix)
    yield "!Loading and Wave Elevation (Units (N,m))"
    yield f"!Dimension: 1 time column -  {n} force columns - 1 wave elevation column"
    for time in (0.0, LAST_TIME):
        yield row_of(np.concatenate([[time], f, [0.0]]))


def row_of(values: Array) -> str:
    """Return numbers on one line, in full precision."""
    return " ".join(f"{value:24.16e}" for value in np.asarray(values).tolist())
