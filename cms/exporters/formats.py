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
    FileFormat(
        "modal joint, FEM data", "MBDyn", "reduced body", (".fem",), writes=True, key="mbdyn",
        tried="record groups of its source (1.7, develop)", lost="load cases, stress; rotations beside interfaces",
    ),
    FileFormat(
        "SID_FEM, m1(row, q, column)", "PY_SID, EMBSlib", "reduced body", (".SID_FEM",), writes=True, key="sid_fem",
        tried="layout of PY_SID's files", lost="second order of J(q), load cases, stress",
    ),
    FileFormat(
        "SID_FEM, m1(row, column, q)", "FEMBeam, welib", "reduced body", (".SID_FEM",), writes=True,
        key="sid_fem-fembeam", lost="second order of J(q), load cases, stress",
    ),
)  #: one line a format; `cms formats` and docs/formats.md list them  # fmt: skip
