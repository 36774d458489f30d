"""The formats of bodies that another program has reduced."""

from fe_models.foundation.formats import FileFormat

__all__ = ["FORMATS"]

FORMATS = (
    FileFormat(
        "external superelement (EXTSEOUT)", "Nastran", "reduced body", (".op4", ".pch", ".asm"), reads=True,
        key="nastran", tried="NX Nastran (sample of pyYeti)",
        lost="3C, 4C, 5C unless masses are beside; rows of element forces and stresses; structural damping",
    ),
    FileFormat(
        "reduced matrices", "any of the matrix formats", "reduced body", (".mtx", ".op4", ".npz", ".mat"), reads=True,
        key="matrices", tried="our own Craig-Bampton matrices",
        lost="3C, 4C, 5C unless masses are beside; stress; rows say their dofs, or --boundary does",
    ),
)  #: one line a format; `cms formats` and docs/formats.md list them  # fmt: skip
