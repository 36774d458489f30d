"""The modal file: a reduced body as self-describing HDF5 (specified in docs/modal_file.md)."""

import os
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from cms.errors import CmsError, ModalFileError
from cms.invariants import Moments
from cms.reduced_body import BodyFrame, ReducedBody, ReducedInterface
from cms.sealed_hdf5 import Attribute, Content, Dataset, read_sealed, write_sealed
from cms.units import UNIT_SYSTEMS, Units

__all__ = ["FORMAT", "VERSION", "digest", "read", "write"]

FORMAT = "modal-file"
VERSION = 1  #: of the format; a reader refuses greater ones
SI = UNIT_SYSTEMS["m-kg-s"]
INVARIANT_DEFECT = 1e-12  #: largest difference of a stored 1C-5C from that of the moments, over the largest entry


def write(reduced: ReducedBody, path: str | os.PathLike[str]) -> None:
    """Write a reduced body to a modal file; a file of that name is replaced in one step or left as it is.

    Raises
    ------
    ModalFileError
        If the file cannot be written.
    """
    write_sealed(content_of(reduced), path)


def read(path: str | os.PathLike[str]) -> ReducedBody:
    """Read a modal file; every array equals the written one bit for bit.

    Raises
    ------
    ModalFileError
        If the file is missing, truncated, altered, of another kind or of a newer version, or if what it says does not
        fit together.
    """
    content = read_sealed(path, format=FORMAT, version=VERSION)
    try:
        body = body_of(Contents(content))
    except CmsError as error:
        raise ModalFileError(f"{Path(path)}: {error}") from error
    require_same_invariants(Path(path), content, body.moments)
    return body


def digest(path: str | os.PathLike[str]) -> str:
    """Return the digest of a modal file: equal for equal contents (sha256, 64 hexadecimal digits)."""
    return str(read_sealed(path, format=FORMAT, version=VERSION).attributes["/"]["digest"])


# Body to content -----------------------------------------------------------------------------------------------------


def content_of(body: ReducedBody) -> Content:
    """Return what the modal file of a body says."""
    units = {field.name: getattr(body.units, field.name) for field in fields(Units)}
    attributes: dict[str, Mapping[str, Attribute]] = {
        "/": {"name": body.name, "n_modes": body.n_q, "n_nodes": len(body.nodes)},
        "/units": units,
        "/frame": {"kind": body.frame.kind, "at": body.frame.at},
        "/modes": {},
        "/moments": {"is_exact": int(body.moments.is_exact)},
        "/invariants": {},
        "/nodes": {},
        "/surface": {},
        "/interfaces": {"count": len(body.interfaces)},
        "/provenance": dict(body.provenance),
    }
    for k, interface in enumerate(body.interfaces):
        attributes[f"/interfaces/{k}"] = {"name": interface.name, "kind": interface.kind}
    return Content(FORMAT, VERSION, datasets_of(body), attributes)


def datasets_of(body: ReducedBody) -> dict[str, Dataset]:
    """Return the datasets of a body, each with its unit and a description.

    The shapes are M-orthonormal, so that a shape has unit mass^(-1/2) and q has mass^(1/2) length.
    """

    def unit(mass: float = 0, length: float = 0, time: float = 0) -> str:
        return unit_text(body.units, mass, length, time)

    moments, per_time = body.moments, unit(0, 0, -1)
    shape, slope = unit(-0.5), unit(-0.5, -1)
    # fmt: off
    table: dict[str, tuple[Any, str, str]] = {
        "/frame/origin": (body.frame.origin, unit(0, 1), "origin of the body frame B in mesh coordinates"),
        "/frame/axes": (body.frame.axes, "1", "columns: axes of B in mesh axes; c_mesh = origin + axes c_B"),
        "/modes/M": (body.M, "1", "modal mass Phi.T M Phi: the identity, zero rows for massless shapes"),
        "/modes/K": (body.K, unit(0, 0, -2), "modal stiffness Phi.T K Phi: diagonal of squared angular frequencies"),
        "/modes/D": (body.D, per_time, "modal damping Phi.T D Phi"),
        "/modes/frequencies": (body.frequencies, per_time, "of each mode with B held, cycles per time unit; infinite "
                                                           "for massless shapes"),
        "/modes/free_frequencies": (body.free_frequencies, per_time, "elastic frequencies of the unsupported body, "
                                                                     "ascending, cycles per time unit"),
        "/modes/labels": (body.labels, "1", "one per mode, in words"),
        "/modes/sources": (body.sources, "1", "names of the groups of source columns"),
        "/modes/energy_shares": (body.energy_shares, "1", "share of each source (column) in a mode's energy (row)"),
        "/moments/m": (np.float64(moments.m), unit(1), "mass"),
        "/moments/S": (moments.S, unit(1, 1), "first moment, int c_a"),
        "/moments/R": (moments.R, unit(1, 2), "second moment, int c_a c_b"),
        "/moments/C1": (moments.C1, unit(0.5), "1C, int phi_a,k"),
        "/moments/P": (moments.P, unit(0.5, 1), "int c_a phi_b,k; index order a, b, k"),
        "/moments/S_kl": (moments.S_kl, "1", "int phi_a,k phi_b,l; index order a, b, k, l"),
        "/invariants/J0": (moments.J0, unit(1, 2), "inertia tensor of the undeformed body about the origin of B"),
        "/invariants/C1": (moments.C1, unit(0.5), "1C_k, int phi_k; index order a, k"),
        "/invariants/C2": (moments.C2, unit(0.5, 1), "2C_k, int c x phi_k; index order a, k"),
        "/invariants/C3": (moments.C3, unit(0.5, 1), "3C_k, int (c.phi_k 1 - phi_k c^T); index order k, a, b"),
        "/invariants/C4": (moments.C4, "1", "4C_kl, int phi_l x phi_k; index order k, l, a"),
        "/invariants/C5": (moments.C5, "1", "5C_kl, int (phi_k.phi_l 1 - phi_l phi_k^T); index order k, l, a, b"),
        "/nodes/position": (body.nodes, unit(0, 1), "undeformed position of the kept nodes in B"),
        "/nodes/id": (body.node_ids, "1", "index of the kept nodes in the mesh, from 0"),
        "/nodes/Phi": (body.Phi, shape, "translation of the kept nodes in B; index order node, component, mode"),
        "/surface/triangles": (body.surface, "1", "kept nodes of each triangle, from 0"),
    }
    # fmt: on
    for k, interface in enumerate(body.interfaces):
        table |= {
            f"/interfaces/{k}/position": (interface.position, unit(0, 1), "undeformed reference point in B"),
            f"/interfaces/{k}/triad": (interface.triad, "1", "columns: undeformed axes of the interface in B"),
            f"/interfaces/{k}/Psi": (
                interface.Psi,
                f"{shape} (rows 0-2), {slope} (rows 3-5)",
                "translation and rotation of the reference point in B for each mode",
            ),
            f"/interfaces/{k}/members": (interface.members, "1", "kept nodes of the interface, from 0"),
        }
    return {path: Dataset(*entry) for path, entry in table.items()}


def unit_text(units: Units, mass: float, length: float, time: float) -> str:
    """Return a unit in ASCII, such as 't^(1/2) mm' or 's^-2'; '1' if there is none."""
    parts = []
    for symbol, power in ((units.mass_symbol, mass), (units.length_symbol, length), (units.time_symbol, time)):
        if power:
            exponent = f"{power:g}" if power == int(power) else f"({2 * power:g}/2)"
            parts.append(symbol if power == 1 else f"{symbol}^{exponent}")
    return " ".join(parts) or "1"


# Content to body -----------------------------------------------------------------------------------------------------


class Contents:
    """Datasets and attributes of a file by path, with words for what is missing or of another kind."""

    def __init__(self, content: Content) -> None:
        self.content = content

    def array(self, path: str) -> np.ndarray:
        """Return the numbers of a dataset."""
        values = self._values(path)
        if isinstance(values, tuple):
            raise ModalFileError(f"dataset {path}: expected numbers, got text")
        return values

    def words(self, path: str) -> tuple[str, ...]:
        """Return the strings of a dataset."""
        values = self._values(path)
        if not isinstance(values, tuple):
            raise ModalFileError(f"dataset {path}: expected text, got numbers")
        return values

    def attribute(self, path: str, name: str, kind: type) -> Any:
        """Return an attribute of that kind."""
        value = self.content.attributes.get(path, {}).get(name)
        if not isinstance(value, kind):
            got = "nothing" if value is None else repr(value)
            raise ModalFileError(f"attribute {name!r} of {path}: expected {kind.__name__}, got {got}")
        return value

    def _values(self, path: str) -> Any:
        if path not in self.content.datasets:
            raise ModalFileError(f"dataset {path} is missing; the file was not written by a complete writer")
        return self.content.datasets[path].values


def body_of(contents: Contents) -> ReducedBody:
    """Return the body that a file describes."""
    array, words, attribute = contents.array, contents.words, contents.attribute
    moments = Moments(
        m=float(array("/moments/m")),
        S=array("/moments/S"),
        R=array("/moments/R"),
        C1=array("/moments/C1"),
        P=array("/moments/P"),
        S_kl=array("/moments/S_kl"),
        is_exact=bool(attribute("/moments", "is_exact", int)),
    )
    interfaces = tuple(
        ReducedInterface(
            name=attribute(group, "name", str),
            kind=attribute(group, "kind", str),
            position=array(f"{group}/position"),
            triad=array(f"{group}/triad"),
            Psi=array(f"{group}/Psi"),
            members=array(f"{group}/members"),
        )
        for group in (f"/interfaces/{k}" for k in range(attribute("/interfaces", "count", int)))
    )
    provenance = contents.content.attributes.get("/provenance", {})
    return ReducedBody(
        name=attribute("/", "name", str),
        units=units_of(contents),
        frame=BodyFrame(
            kind=attribute("/frame", "kind", str),
            origin=array("/frame/origin"),
            axes=array("/frame/axes"),
            at=attribute("/frame", "at", str),
        ),
        M=array("/modes/M"),
        K=array("/modes/K"),
        D=array("/modes/D"),
        labels=words("/modes/labels"),
        energy_shares=array("/modes/energy_shares"),
        sources=words("/modes/sources"),
        moments=moments,
        free_frequencies=array("/modes/free_frequencies"),
        nodes=array("/nodes/position"),
        node_ids=array("/nodes/id"),
        Phi=array("/nodes/Phi"),
        surface=array("/surface/triangles"),
        interfaces=interfaces,
        provenance={name: str(value) for name, value in provenance.items()},
    )


def units_of(contents: Contents) -> Units:
    """Return the units of a file; a known name must have its known factors."""
    kinds = {field.name: type(getattr(SI, field.name)) for field in fields(Units)}
    units = Units(**{name: contents.attribute("/units", name, kind) for name, kind in kinds.items()})
    if UNIT_SYSTEMS.get(units.name, units) != units:
        raise ModalFileError(f"units {units.name!r}: expected the factors of that system, got {units}")
    return units


def require_same_invariants(path: Path, content: Content, moments: Moments) -> None:
    """Raise unless the stored invariants, written for other readers, are those of the moments."""
    for name in ("J0", "C1", "C2", "C3", "C4", "C5"):
        stored = Contents(content).array(f"/invariants/{name}")
        expected = getattr(moments, name)
        scale = np.abs(expected).max(initial=0.0)
        if stored.shape != expected.shape or np.abs(stored - expected).max(initial=0.0) > INVARIANT_DEFECT * scale:
            raise ModalFileError(
                f"{path}: dataset /invariants/{name} does not follow from the moments; "
                "the file was written by a faulty writer"
            )
