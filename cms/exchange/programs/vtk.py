"""ParaView: every mode as a deformed surface (.vtu) with displacement and stress, and their collection (.pvd)."""

import base64
from collections.abc import Mapping
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from cms.body.reduced_body import ReducedBody
from cms.body.stress import von_mises
from cms.exchange.exporters.writer import Request, WrittenFiles
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["make_vtk", "numbers_of_cells", "numbers_of_nodes"]


LARGEST = 0.05  #: largest displacement of a drawn mode divided by the size of the body
#: stress components xx yy zz xy yz xz as indices into xx yy zz yz xz xy of this project
STRESS_ORDER = [0, 1, 2, 5, 3, 4]
TRIANGLE, VERTEX = 5, 1  #: VTK codes of the cell types
KINDS = {"f": ("Float64", "<f8"), "i": ("Int64", "<i8"), "u": ("UInt8", "u1")}


def make_vtk(request: Request) -> WrittenFiles:
    """Return FILE.pvd and FILE_1.vtu, FILE_2.vtu, ...: undeformed points in mesh coordinates, fields in mesh axes.

    The coordinate q of a mode is chosen so that its largest nodal displacement is a twentieth of the body size. Stress
    and displacement belong to this q, which is stored in the field data together with the frequency.
    """
    body = request.body
    points = body.frame.origin + body.nodes @ body.frame.axes.T
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    path = request.path.with_suffix(".pvd")
    files: dict[Path, bytes] = {path: b""}
    entries = []
    for k in range(body.n_q):
        shape = body.Phi[:, :, k] @ body.frame.axes.T
        largest = float(np.linalg.norm(shape, axis=1).max(initial=0.0))
        q = LARGEST * size / largest if largest * size > 0 else 1.0
        fields = {"displacement": q * shape, **stress_fields(body, k, q), **numbers_of_nodes(body)}
        hertz = body.frequencies[k] / body.units.time
        whole = {"q": np.array([q]), "frequency": np.array([hertz])}
        name = path.with_name(f"{path.stem}_{k + 1}.vtu")
        files[name] = unstructured_grid(points, body.surface, fields, whole, request.header(), numbers_of_cells(body))
        entries.append(f'<DataSet timestep="{k + 1}" file={quoteattr(name.name)}/>')
    collection = ['<VTKFile type="Collection" version="0.1">', "<Collection>", *entries, "</Collection>", "</VTKFile>"]
    files[path] = ("\n".join(['<?xml version="1.0"?>', *comment(request.header()), *collection]) + "\n").encode("utf-8")
    return WrittenFiles(files, ("time k of the collection is mode k; warp by the vector displacement",))


def stress_fields(body: ReducedBody, k: int, q: float) -> dict[str, Array]:
    """Return stress tensor (mesh axes, order of VTK) and von Mises stress at the nodes, if the body has stress."""
    if body.stress is None:
        return {}
    from cms.reduction.basis.node_results import turned_stress

    stress = q * turned_stress(np.asarray(body.stress)[:, :, k : k + 1], body.frame.axes.T)[:, :, 0]
    return {"stress": stress[:, STRESS_ORDER], "von Mises stress": von_mises(stress)}


def numbers_of_nodes(body: ReducedBody) -> dict[str, IntArray]:
    """Return the user's numbers of the kept nodes (-1 if there is none), and their instances."""
    arrays = {"node": body.numbering.nodes, "node instance": body.numbering.node_instance}
    return {name: numbers for name, numbers in arrays.items() if numbers.size}


def numbers_of_cells(body: ReducedBody) -> dict[str, IntArray]:
    """Return the user's numbers of the elements behind the triangles (-1 if there is none), and their instances."""
    if not len(body.surface):
        return {}
    arrays = {"element": body.numbering.elements, "element instance": body.numbering.element_instance}
    return {name: numbers for name, numbers in arrays.items() if numbers.size}


def unstructured_grid(
    points: Array,
    triangles: IntArray,
    fields: Mapping[str, np.ndarray],
    whole: Mapping[str, Array],
    header: tuple[str, ...],
    of_cells: Mapping[str, IntArray],
) -> bytes:
    """Return a .vtu file with numbers in base64: triangles, or only points if there are none."""
    cells = np.asarray(triangles) if len(triangles) else np.arange(len(points))[:, None]
    n, per = cells.shape
    kind = TRIANGLE if per == 3 else VERTEX
    lines = [
        '<?xml version="1.0"?>', *comment(header),
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
        "<UnstructuredGrid>", "<FieldData>", *(data_array(name, values, tuples=True) for name, values in whole.items()),
        "</FieldData>", f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{n}">',
        "<Points>", data_array("Points", points), "</Points>", "<Cells>",
        data_array("connectivity", cells.reshape(-1)), data_array("offsets", per * np.arange(1, n + 1)),
        data_array("types", np.full(n, kind, dtype=np.uint8)), "</Cells>", "<PointData>",
        *(data_array(name, values) for name, values in fields.items()), "</PointData>",
        "<CellData>", *(data_array(name, values) for name, values in of_cells.items()), "</CellData>",
        "</Piece>", "</UnstructuredGrid>", "</VTKFile>",
    ]  # fmt: skip
    return ("\n".join(lines) + "\n").encode("utf-8")


def data_array(name: str, values: np.ndarray, *, tuples: bool = False) -> str:
    """Return a data array as base64: its length in bytes, then its numbers."""
    array = np.asarray(values)
    word, dtype = KINDS[array.dtype.kind]
    data = np.ascontiguousarray(array, dtype=dtype).tobytes()
    components = f' NumberOfComponents="{array.shape[1]}"' if array.ndim == 2 else ""
    count = f' NumberOfTuples="{len(array)}"' if tuples else ""
    text = base64.b64encode(len(data).to_bytes(8, "little") + data).decode("ascii")
    return f'<DataArray type="{word}" Name={quoteattr(name)}{components}{count} format="binary">{text}</DataArray>'


def comment(lines: tuple[str, ...]) -> list[str]:
    """Return the header as XML comments, which must not contain two consecutive hyphens."""
    return [f"<!-- {escape(line).replace('--', '- -')} -->" for line in lines]
