"""The formats of bodies that another program has reduced."""

from fe_models.foundation.formats import FileFormat

__all__ = ["FORMATS"]

FORMATS = (
    FileFormat(
        "external superelement (EXTSEOUT)", "Nastran", "reduced body", (".op4", ".pch", ".asm"), reads=True,
        key="nastran", tried="NX Nastran (sample of pyYeti)",
        lost="3C, 4C, 5C unless masses are beside; forces of elements of unknown items; structural damping",
    ),
    FileFormat(
        "CMS superelement", "ANSYS", "reduced body", (".sub",), reads=True, key="matrices",
        tried="example-data of PyMAPDL (cp56.sub)", lost="3C, 4C, 5C unless masses are beside",
    ),
    FileFormat(
        "*SUBSTRUCTURE MATRIX OUTPUT, *USER ELEMENT", "Abaqus, CalculiX", "reduced body", (".mtx",), reads=True,
        key="matrices", tried="our own matrices in its layout",
        lost="3C, 4C, 5C unless masses are beside; retained modes; places: a deck beside it",
    ),
    FileFormat(
        "reduced matrices", "any of the matrix formats", "reduced body", (".mtx", ".op4", ".npz", ".mat"), reads=True,
        key="matrices", tried="our own Craig-Bampton matrices",
        lost="3C, 4C, 5C unless masses are beside; stress; rows say their dofs, or --boundary does",
    ),
    FileFormat(
        "ExternalFlexibleFfrBody, HDF5", "MBSim", "reduced body", (".h5",), reads=True, key="mbsim",
        tried="files of our writer; names and orders of its source",
    ),
    FileFormat(
        "ObjectFFRFreducedOrder, npz", "Exudyn", "reduced body", (".npz",), reads=True, key="exudyn",
        tried="files of our writer, which exudyn 1.13.6 runs", lost="stress (a pickled object, which is never opened)",
    ),
    FileFormat(
        "modal joint, FEM data", "MBDyn", "reduced body", (".fem",), reads=True, key="mbdyn",
        tried="files of our writer", lost="stress stiffening where an interface is no single node",
    ),
    FileFormat(
        "SID_FEM, m1(row, q, column)", "PY_SID, EMBSlib", "reduced body", (".SID_FEM",), reads=True, key="sid_fem",
        tried="files of our writer", lost="geometric stiffness without 5C (Gr of first order)",
    ),
    FileFormat(
        "SID_FEM, m1(row, column, q)", "FEMBeam, welib", "reduced body", (".SID_FEM",), reads=True,
        key="sid_fem-fembeam", tried="files of our writer", lost="geometric stiffness without 5C (Gr of first order)",
    ),
    FileFormat(
        "ExtPtfm, FlexASCII", "OpenFAST", "reduced body", (".dat",), reads=True, key="ext_ptfm",
        tried="files of our writer", lost="3C, 4C, 5C; loads that change with time; the place of the node",
    ),
)  #: one line a format; `cms formats` and docs/formats.md list them  # fmt: skip
