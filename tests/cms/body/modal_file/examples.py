"""Systems, bodies and helpers that several tests share: file."""

from dataclasses import fields, is_dataclass

import numpy as np


def differences(a, b, where="body") -> list[str]:
    """Return the fields in which two values differ, bit for bit, over every field of every dataclass."""
    if is_dataclass(a):
        return [d for f in fields(a) for d in differences(getattr(a, f.name), getattr(b, f.name), f"{where}.{f.name}")]
    if isinstance(a, np.ndarray):
        same = a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
        return [] if same else [where]
    if isinstance(a, tuple):
        if len(a) != len(b):
            return [where]
        return [d for k, pair in enumerate(zip(a, b, strict=True)) for d in differences(*pair, f"{where}[{k}]")]
    return [] if a == b else [where]
