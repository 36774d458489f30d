"""The formats that a reduced body is written in."""

from fe_models.foundation.formats import FileFormat

__all__ = ["FORMATS"]

FORMATS = (
    FileFormat(
        "ExternalFlexibleFfrBody, HDF5", "MBSim", "reduced body", (".h5",), writes=True, key="mbsim",
        tried="h5py; names and orders of its source",
        lost="geometric stiffness, load cases; rotations beside interfaces",
    ),
    FileFormat(
        "ObjectFFRFreducedOrder, npz and script", "Exudyn", "reduced body", (".npz", ".py"), writes=True, key="exudyn",
        tried="exudyn 1.13.6", lost="geometric stiffness, load cases",
    ),
)  #: one line a format; `cms formats` and docs/formats.md list them  # fmt: skip
