"""Tests that were never made: modes of a model, disturbed, as the files of a test. Written from the format's fields."""

from pathlib import Path

import numpy as np


def universal_text(numbers, places, frequencies, shapes, damping, *, units=1, complex_phase=None, system=0) -> str:
    """Datasets 164, 2411 and 55 as text; shapes (n_points, 3, n)."""
    lines = []

    def dataset(kind, rows):
        lines.extend([f"{-1:6d}", f"{kind:6d}", *rows, f"{-1:6d}"])

    if units is not None:
        factors = "".join(f"{x:25.16E}" for x in (1.0, 1.0, 1.0)).replace("E", "D")
        dataset(164, [f"{units:10d}{'units':>20}{1:10d}", factors, f"{273.15:25.16E}".replace("E", "D")])
    rows = []
    for number, place in zip(numbers, places, strict=True):
        rows += [f"{number:10d}{0:10d}{system:10d}{1:10d}", "".join(f"{x:25.16E}" for x in place).replace("E", "D")]
    dataset(2411, rows)
    for k, f in enumerate(frequencies):
        is_complex = complex_phase is not None
        kind, data = (3, 5) if is_complex else (2, 2)
        rows = ["mode"] * 5 + [f"{1:10d}{kind:10d}{2:10d}{8:10d}{data:10d}{3:10d}"]
        if is_complex:
            omega = 2 * np.pi * f
            eig = -damping[k] * omega + 1j * omega * np.sqrt(1 - damping[k] ** 2)
            rows += [
                f"{2:10d}{6:10d}{1:10d}{k + 1:10d}",
                "".join(f"{x:13.5E}" for x in (eig.real, eig.imag, 1, 0, 0, 0)),
            ]
        else:
            rows += [f"{2:10d}{4:10d}{1:10d}{k + 1:10d}", "".join(f"{x:13.5E}" for x in (f, 1.0, damping[k], 0.0))]
        for number, shape in zip(numbers, shapes[:, :, k], strict=True):
            values = shape
            if is_complex:
                turned = shape * np.exp(1j * complex_phase)
                values = np.column_stack([turned.real, turned.imag]).ravel()
            rows += [f"{number:10d}", "".join(f"{x:13.5E}" for x in values)]
        dataset(55, rows)
    return "\n".join(lines) + "\n"


def mode_table_text(numbers, directions, places, frequencies, shapes, damping) -> str:
    """The same as a table; shapes (n_rows, n)."""
    head = [
        "point",
        "direction",
        "x",
        "y",
        "z",
        *(f"{f:.9g} Hz {100 * d:.4g} %" for f, d in zip(frequencies, damping, strict=True)),
    ]
    lines = [", ".join(head)]
    for k, number in enumerate(numbers):
        row = [str(number), " ".join(f"{x:.9g}" for x in directions[k]), *(f"{x:.9g}" for x in places[k])]
        lines.append(", ".join([*row, *(f"{x:.9g}" for x in shapes[k])]))
    return "\n".join(lines) + "\n"


def write(path: Path, text: str) -> Path:
    """Write a file and return its path."""
    path.write_text(text)
    return path
