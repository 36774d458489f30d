"""One gmsh model at a time: gmsh is loaded when needed, and its options are set for repeatable meshes and restored."""

import ctypes
import os
import signal
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import ModuleType

from fe_models.errors import MeshError, MeshingError
from fe_models.foundation.extras import MissingExtraError, extra_module

__all__ = ["gmsh_call", "gmsh_model", "kept_sigpipe", "load_gmsh"]

OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,  # threads change the order of operations, and with it the mesh
    "Mesh.RandomSeed": 1,
    "Mesh.Algorithm": 6,
    "Mesh.Algorithm3D": 10,  # HXT: fewer and better tetrahedra than Delaunay here, and the same ones every time
    "Mesh.MeshSizeExtendFromBoundary": 1,
    "Mesh.MshFileVersion": 4.1,
    "Mesh.Binary": 1,
    "Mesh.SaveAll": 0,  # only the named groups: curves and unnamed faces would be noise to a reader
    "Mesh.SecondOrderLinear": 0,
    "Mesh.HighOrderOptimize": 1,  # mid-side nodes move to the curved faces, and the elements behind them adapt
    "Mesh.Optimize": 1,
    "Mesh.OptimizeNetgen": 1,
}
LIBRARIES = "apt-get install libglu1-mesa libxrender1 libxcursor1 libxft2 libxinerama1"


def load_gmsh() -> ModuleType:
    """Return the module gmsh.

    Raises
    ------
    MeshingError
        If it is not installed, or a system library that it needs is missing; the message says how to install it.
    """
    try:
        return extra_module("gmsh", extra="mesh", purpose="meshing a part")
    except MissingExtraError as error:
        is_broken = not isinstance(error.__cause__, ModuleNotFoundError)
        raise MeshingError(f"{error}{f'; on Debian or Ubuntu: {LIBRARIES}' if is_broken else ''}") from error


@contextmanager
def gmsh_model(name: str, options: Mapping[str, float | str]) -> Iterator[ModuleType]:
    """Open an empty gmsh model and always close it; options are restored.

    Parameters
    ----------
    name
        Name of the model.
    options
        Options of gmsh, numbers or texts, in addition to those that make meshes repeatable.
    """
    gmsh = load_gmsh()
    was_open = bool(gmsh.isInitialized())
    if not was_open:
        with kept_sigpipe():
            gmsh.initialize(readConfigFiles=False, interruptible=False)
    wanted = OPTIONS | dict(options)
    before = {option: _get(gmsh, option, value) for option, value in wanted.items()}
    try:
        for option, value in wanted.items():
            _set(gmsh, option, value)
        gmsh.model.add(name)
        try:
            yield gmsh
        finally:
            gmsh.model.remove()
    finally:
        for option, value in before.items():
            _set(gmsh, option, value)
        if not was_open:
            gmsh.finalize()


@contextmanager
def kept_sigpipe() -> Iterator[None]:
    """Restore how SIGPIPE is handled: as gmsh leaves it, a write to a closed pipe would end this process in silence."""
    if sys.platform == "win32":
        yield
        return
    get, put = ctypes.pythonapi.PyOS_getsig, ctypes.pythonapi.PyOS_setsig  # signal.signal works in one thread only
    get.argtypes, get.restype = [ctypes.c_int], ctypes.c_void_p
    put.argtypes, put.restype = [ctypes.c_int, ctypes.c_void_p], ctypes.c_void_p
    before = get(signal.SIGPIPE)
    try:
        yield
    finally:
        put(signal.SIGPIPE, before)


def _get(gmsh: ModuleType, option: str, like: float | str) -> float | str:
    value: float | str = gmsh.option.getString(option) if isinstance(like, str) else gmsh.option.getNumber(option)
    return value


def _set(gmsh: ModuleType, option: str, value: float | str) -> None:
    if isinstance(value, str):
        gmsh.option.setString(option, value)
    else:
        gmsh.option.setNumber(option, value)


@contextmanager
def gmsh_call(where: str, *, advice: str) -> Iterator[None]:
    """Convert errors of gmsh to one message, and suppress the output of its kernel.

    Parameters
    ----------
    where
        Beginning of the message.
    advice
        End of the message, which says what to do.

    Raises
    ------
    MeshError
        If gmsh raises an exception.
    """
    try:
        with _quiet():
            yield
    except Exception as error:  # gmsh raises bare Exception
        if type(error) is not Exception:
            raise
        text = " ".join(str(error).split())[:200]
        raise MeshError(f"{where}: {text or 'gmsh gave no reason'}; {advice}") from error


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress standard output of C++ code: readers of OpenCASCADE ignore the options of gmsh."""
    sys.stdout.flush()
    try:
        kept = os.dup(1)
    except OSError:  # there is no standard output
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)
