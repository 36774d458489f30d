"""Addresses of the BLAS and LAPACK routines of SciPy, for calls without the Python interpreter."""

import ctypes

__all__ = ["routine_address"]


def routine_address(name: str) -> tuple[int, int]:
    """Return the address of a routine such as "dgemm", and the number of its arguments, which are all pointers."""
    from scipy.linalg import cython_blas, cython_lapack

    capsules = cython_blas.__pyx_capi__ if name in cython_blas.__pyx_capi__ else cython_lapack.__pyx_capi__
    get_name, get_pointer = ctypes.pythonapi.PyCapsule_GetName, ctypes.pythonapi.PyCapsule_GetPointer
    get_name.restype, get_name.argtypes = ctypes.c_char_p, [ctypes.py_object]
    get_pointer.restype, get_pointer.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    capsule = capsules[name]
    signature = get_name(capsule)
    return get_pointer(capsule, signature), signature.count(b",") + 1
