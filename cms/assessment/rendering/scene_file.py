"""File of a scene for the drawing process: an .npz with arrays, and everything else as JSON in it; no pickles."""

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from cms.assessment.rendering.scene import Lines, Scene, Surface, Triad

__all__ = ["read_scene", "write_scene"]

PARTS = {"surfaces": Surface, "lines": Lines, "triads": Triad}


def write_scene(scene: Scene, path: Path) -> None:
    """Write a scene; moving positions are in single precision, which is finer than any pixel."""
    arrays: dict[str, np.ndarray] = {}
    plain: dict[str, Any] = {}

    def put(owner: Any, prefix: str) -> None:
        for field in fields(owner):
            value = getattr(owner, field.name)
            if field.name in PARTS and isinstance(owner, Scene):
                plain[field.name] = len(value)
            elif isinstance(value, np.ndarray):
                moving = value.dtype == np.float64 and value.ndim > 1
                arrays[prefix + field.name] = value.astype(np.float32) if moving else value
            else:
                plain[prefix + field.name] = value

    put(scene, "")
    for name in PARTS:
        for k, part in enumerate(getattr(scene, name)):
            put(part, f"{name}.{k}.")
    np.savez(path, __plain__=np.frombuffer(json.dumps(plain).encode(), dtype=np.uint8), allow_pickle=False, **arrays)


def read_scene(path: Path) -> Scene:
    """Read a scene from a file that `write_scene` wrote."""
    with np.load(path, allow_pickle=False) as archive:
        values: dict[str, Any] = json.loads(archive["__plain__"].tobytes())
        values |= {name: archive[name] for name in archive.files if name != "__plain__"}

    def take(owner: Any, prefix: str) -> dict[str, Any]:
        found = {field.name: values.get(prefix + field.name) for field in fields(owner)}
        return {name: tuple(value) if isinstance(value, list) else value for name, value in found.items()}

    parts = {
        name: tuple(kind(**take(kind, f"{name}.{k}.")) for k in range(values[name])) for name, kind in PARTS.items()
    }
    return Scene(**(take(Scene, "") | parts))
