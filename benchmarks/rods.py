"""Meshes of connecting rods for benchmarks, made by gmsh once and kept in benchmarks/out."""

from pathlib import Path

__all__ = ["OUT", "rod_file"]

OUT = Path(__file__).parent / "out"


def rod_file(name, size):
    """Return the mesh file of a rod, tet10 with edges of this size [mm]; its folder is there then."""
    from fe_models.parts import mesh_connecting_rod

    OUT.mkdir(exist_ok=True)
    path = OUT / f"rod_{name}.msh"
    if not path.is_file():
        mesh_connecting_rod(size=size, path=path)
    return path
