"""The file formats in which a reduced body can be written."""

from fe_models.foundation.formats import FileFormat

__all__ = ["FORMATS"]

BEYOND_MASS = "inertia beyond the mass matrix, geometric stiffness, stress"

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
    FileFormat(
        "MAT-file of version 5", "MATLAB, Octave", "reduced body", (".mat",), writes=True, key="mat",
        tried="scipy 1.17", lost=BEYOND_MASS,
    ),
    FileFormat(
        "MAT-file of version 7.3", "MATLAB", "reduced body", (".mat",), writes=True, key="mat73",
        tried="h5py, by the attributes of MATLAB", lost=BEYOND_MASS,
    ),
    FileFormat(
        "Reduced Order Flexible Solid (P, K, M, C)", "Simscape Multibody", "reduced body", (".mat",), writes=True,
        key="simscape", tried="scipy 1.17", lost=f"{BEYOND_MASS}, load cases",
    ),
    FileFormat(
        "Matrix Market", "many", "reduced body", (".mtx",), writes=True, key="matrix-market", tried="scipy 1.17",
        lost=BEYOND_MASS,
    ),
    FileFormat(
        "OUTPUT4 with .asm, .pch", "Nastran", "reduced body", (".op4", ".asm", ".pch"), writes=True, key="nastran-op4",
        tried="pyYeti 1.4.7, pyNastran 1.4", lost=BEYOND_MASS,
    ),
    FileFormat(
        "DMIG", "Nastran", "reduced body", (".pch",), writes=True, key="nastran-dmig",
        tried="pyYeti 1.4.7, pyNastran 1.4", lost=f"{BEYOND_MASS}, digits beyond the tenth",
    ),
    FileFormat(
        "linear *USER ELEMENT", "Abaqus", "reduced body", (".inp",), writes=True, key="abaqus",
        tried="our own reader", lost=f"{BEYOND_MASS}, load cases",
    ),
    FileFormat(
        "ExtPtfm, FlexASCII", "OpenFAST", "reduced body", (".dat",), writes=True, key="ext_ptfm",
        tried="its documentation", lost=f"{BEYOND_MASS}, all interfaces but one",
    ),
    FileFormat(
        "VTU, PVD", "ParaView", "reduced body", (".pvd", ".vtu"), writes=True, key="vtk", tried="pyvista, meshio",
        lost="all but shapes and stress",
    ),
)  #: one line for each format; `cms formats` and docs/formats.md list them  # fmt: skip
