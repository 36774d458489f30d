"""The formats of finite element programs that are read: meshes, decks, matrices, geometry."""

from fe_models.foundation.formats import FileFormat

__all__ = ["FORMATS"]

FORMATS = (
    FileFormat("MSH 2.2, 4.1", "Gmsh", "mesh", (".msh",), reads=True, tried="Gmsh 4.15"),
    FileFormat("VTK, VTU", "ParaView", "mesh", (".vtk", ".vtu"), reads=True, tried="meshio 5.3, pyvista"),
    FileFormat(
        "input deck",
        "Abaqus, CalculiX",
        "mesh",
        (".inp",),
        reads=True,
        tried="decks of ccx 2.20",
        lost="all but the mesh and its sets",
    ),
    FileFormat(
        "bulk data",
        "Nastran",
        "deck",
        (".bdf", ".nas", ".dat", ".fem", ".blk", ".bulk", ".asm", ".pch"),
        reads=True,
        key="cms job",
        tried="decks of MSC Nastran 2020",
        lost="layers, tapered beams, released ends, RBE1, scalar points: each listed with its count",
    ),
    FileFormat(
        "CDB",
        "ANSYS",
        "deck",
        (".cdb",),
        reads=True,
        key="cms job",
        tried="ANSYS 2019 R2",
        lost="all but SOLID185, 186, 187, materials, components, supports, forces: each listed with its count",
    ),
    FileFormat(
        "input deck",
        "Abaqus, CalculiX",
        "deck",
        (".inp",),
        reads=True,
        key="cms job",
        tried="decks of ccx 2.20",
        lost="contact, nonlinear and anisotropic materials, layers, steps: each listed with its count",
    ),
    FileFormat(
        "bulk data", "Nastran", "mesh", (".bdf", ".nas", ".dat", ".fem", ".blk", ".bulk"), reads=True,
        lost="all but the mesh",
    ),
    FileFormat("MED", "Salome, code_aster", "mesh", (".med",), reads=True),
    FileFormat(
        "OUTPUT4", "Nastran", "matrices", (".op4",), reads=True,
        tried="NX 9.1, Simcenter of 2020, MSC 2017",
    ),
    FileFormat(
        "OUTPUT2, matrix data blocks", "Nastran", "matrices", (".op2",), reads=True, tried="NX 9.1", extra="nastran",
        lost="tables",
    ),
    FileFormat("DMIG, EXTRN", "Nastran", "matrices", (".pch", ".asm"), reads=True, tried="NX 9.1"),
    FileFormat(
        "external superelement", "Nastran", "matrices", (".op4", ".pch", ".asm"), reads=True,
        tried="NX 9.1, Simcenter of 2020, MSC 2017",
        lost="structural damping (K4)",
    ),
    FileFormat(
        ".full", "ANSYS", "matrices", (".full",), reads=True, tried="2017 to 2019 (100033)",
        lost="positions: a deck beside it; lumped masses and constraint equations are refused",
    ),
    FileFormat(".sub, superelement", "ANSYS", "matrices", (".sub",), reads=True, tried="2019 to 2020 (121656)"),
    FileFormat(
        "*MATRIX GENERATE, COORDINATE", "Abaqus", "matrices", (".mtx",), reads=True, tried="Abaqus 2021",
        lost="the numbers of nodes: a deck beside it",
    ),
    FileFormat("*MATRIX GENERATE, MATRIX INPUT", "Abaqus", "matrices", (".mtx",), reads=True, tried="by its layout"),
    FileFormat(
        "*SUBSTRUCTURE MATRIX OUTPUT", "Abaqus, CalculiX", "matrices", (".mtx",), reads=True, tried="CalculiX 2.20",
        lost="modes that are retained",
    ),
    FileFormat("MATRIXSTORAGE", "CalculiX", "matrices", (".sti", ".mas", ".dof"), reads=True, tried="CalculiX 2.20"),
    FileFormat(
        "Matrix Market, with nodes of its rows", "Ansys, SciPy", "matrices", (".mtx", ".mm", ".mmf", ".txt"),
        reads=True, tried="SciPy 1.17",
    ),
    FileFormat("MAT 5, 7.3", "MATLAB, Octave", "matrices", (".mat",), reads=True, tried="SciPy 1.17, h5py 3"),
    FileFormat("sparse and dense npz", "SciPy, NumPy", "matrices", (".npz",), reads=True, tried="SciPy 1.17"),
    FileFormat("Harwell-Boeing RSA, RUA", "Ansys", "matrices", (".hb", ".rb", ".rsa", ".rua"), reads=True,
               tried="by its layout"),
    FileFormat(
        "STEP", "CAD programs", "geometry", (".step", ".stp"), reads=True, tried="Gmsh 4.15, OpenCASCADE 7.8",
        lost="names of faces, assemblies' structure", extra="mesh",
    ),
    FileFormat(
        "IGES", "CAD programs", "geometry", (".iges", ".igs"), reads=True, tried="Gmsh 4.15, OpenCASCADE 7.8",
        lost="names, bodies with cavities", extra="mesh",
    ),
    FileFormat(
        "BREP", "OpenCASCADE, FreeCAD", "geometry", (".brep",), reads=True, tried="Gmsh 4.15, OpenCASCADE 7.8",
        lost="it has no unit, names, colours", extra="mesh",
    ),
)
#: one line a format; `cms formats` and docs/formats.md list them
