"""The file of a parametric body: the modal files of its samples in one HDF5 file, its parameters, and its errors.

The contents of a sample are those of its modal file (docs/modal_file.md), below /samples/0, /samples/1, ...
"""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from cms.body.modal_file.content import FORMAT, body_of, content_of
from cms.body.modal_file.contents import Content, Contents, Dataset
from cms.body.modal_file.file import VERSION, read_sealed, version_of, write_sealed
from cms.errors import CmsError, ModalFileError
from cms.reduction.parametric.interpolation_errors import InterpolationErrors
from cms.reduction.parametric.parametric_body import ParametricBody
from fe_models.foundation.seal import Kind
from fe_models.foundation.words import quoted

__all__ = ["read_parametric_body", "write_parametric_body"]

KIND = Kind("parametric-body", 1, ModalFileError, "`cms family`")
SAMPLES, PARAMETERS, ERRORS = "/samples", "/parameters", "/errors"  #: paths of the groups
#: number of axes and description of each dataset of the errors
OF_ERRORS = {
    "frequency": (1, "relative error of each frequency with the frame fixed"),
    "free_frequency": (1, "relative error of each free-free frequency"),
    "static": (0, "relative error of the static response of the interfaces"),
    "mass": (0, "relative error of the mass"),
    "inertia": (0, "relative error of the inertia tensor"),
}


def write_parametric_body(body: ParametricBody, path: str | os.PathLike[str]) -> None:
    """Write a parametric body with its samples. An existing file is replaced in one step or stays unchanged.

    Parameters
    ----------
    body
        The parametric body.
    path
        Name of the file, usually with the ending .h5.

    Raises
    ------
    ModalFileError
        If the file cannot be written.
    """
    datasets: dict[str, Dataset] = {f"{PARAMETERS}/names": Dataset(tuple(body.values), "1", "names of the parameters")}
    attributes: dict[str, Mapping[str, Any]] = {"/": {"name": body.samples[0].name}, SAMPLES: {}, PARAMETERS: {}}
    for k, (name, values) in enumerate(body.values.items()):
        datasets[f"{PARAMETERS}/values_{k}"] = Dataset(np.array(values), "1", f"sampled values of {name}")
    for k, sample in enumerate(body.samples):
        content = content_of(sample, VERSION)
        at = f"{SAMPLES}/{k}"
        datasets |= {f"{at}{path}": dataset for path, dataset in content.datasets.items()}
        attributes |= {f"{at}{path}".rstrip("/"): group for path, group in content.attributes.items()}
        attributes[at] = {**attributes.get(at, {}), "modal_file_version": version_of(sample)}
    if body.errors is not None:
        attributes[ERRORS] = {"method": body.errors.method}
        for name, (_, words) in OF_ERRORS.items():
            datasets[f"{ERRORS}/{name}"] = Dataset(np.asarray(getattr(body.errors, name), float), "1", words)
    write_sealed(Content(KIND.format, KIND.version, datasets, attributes), path)


def read_parametric_body(path: str | os.PathLike[str]) -> ParametricBody:
    """Read the file of a parametric body.

    Parameters
    ----------
    path
        File that `write_parametric_body` or `cms family` has written.

    Raises
    ------
    ModalFileError
        If the file is missing, altered, of another kind or of a later version, or its data are inconsistent.
    """
    content = read_sealed(path, KIND)
    contents = Contents(content)
    try:
        names = contents.value(f"{PARAMETERS}/names")
        if not isinstance(names, tuple) or len(set(names)) < len(names):
            raise ModalFileError(f"dataset {PARAMETERS}/names: expected different texts, got {quoted(names)}")
        values = {name: tuple(numbers(contents, f"{PARAMETERS}/values_{k}", 1)) for k, name in enumerate(names)}
        n = int(np.prod([len(given) for given in values.values()]))
        errors = None
        if contents.has(ERRORS):
            found = {name: numbers(contents, f"{ERRORS}/{name}", n_axes) for name, (n_axes, _) in OF_ERRORS.items()}
            errors = InterpolationErrors(**found, method=contents.attribute(ERRORS, "method", str))
        return ParametricBody(
            values, tuple(body_of(content_below(content, f"{SAMPLES}/{k}")) for k in range(n)), errors
        )
    except CmsError as error:
        raise ModalFileError(f"{Path(path)}: {error}") from error


def numbers(contents: Contents, path: str, n_axes: int) -> Any:
    """Return the numbers of a dataset after a check of its number of axes."""
    value = contents.value(path)
    if isinstance(value, tuple) or np.ndim(value) != n_axes:
        got = "text" if isinstance(value, tuple) else f"shape {np.shape(value)}"
        raise ModalFileError(f"dataset {path}: expected {'a list of numbers' if n_axes else 'one number'}, got {got}")
    return value


def content_below(content: Content, at: str) -> Content:
    """Return the content of the modal file of a sample."""
    version = Contents(content).attribute(at, "modal_file_version", int)
    if not 1 <= version <= VERSION:
        raise ModalFileError(
            f"{at} has version {version} of the modal file, this program reads versions 1 to {VERSION}; update the "
            "program (pip install -U floatframe)"
        )
    datasets = {path.removeprefix(at): each for path, each in content.datasets.items() if path.startswith(f"{at}/")}
    groups = {path.removeprefix(at) or "/": group for path, group in content.attributes.items()
              if path == at or path.startswith(f"{at}/")}  # fmt: skip
    groups["/"] = {name: value for name, value in groups["/"].items() if name != "modal_file_version"}
    return Content(FORMAT, version, datasets, groups)
