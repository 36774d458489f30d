"""Arrays as text inside a page: one block of bytes, compressed, and where each array lies in it.

quantised     value = offset + scale * n, n whole numbers of 16 bit; scale and offset one, or one each along an axis
split         of 16 bit: all low bytes, then all high bytes, which compress better than pairs
text          base64 of the zlib stream (RFC 1950) of the block; numbers little-endian
"""

import base64
import hashlib
import zlib
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array, IntArray

__all__ = ["Block", "Packed"]

TOP = 32767  #: of whole numbers of 16 bit
LEVEL = 6  #: of the compression: 9 takes five times as long for 1 %

Packed = dict[str, Any]  #: at, type, shape, and of quantised numbers scale, offset, each: where it lies, what it means


@dataclass
class Block:
    """Arrays one after the other; grows as they are added."""

    parts: list[bytes] = field(default_factory=list)
    size: int = 0  #: bytes so far
    places: dict[bytes, int] = field(default_factory=dict)  #: of arrays, by the digest of their bytes

    def real(self, values: Array) -> Packed:
        """Add numbers in 32 bit."""
        return self.add(np.asarray(values), "f4")

    def whole(self, values: IntArray) -> Packed:
        """Add whole numbers from 0, in 16 bit where they fit."""
        values = np.asarray(values)
        return self.add(values, "u2" if values.max(initial=0) < 65536 else "u4")

    def quantised(self, values: Array, *, each: int | None = None, centred: bool = False) -> Packed:
        """Add numbers in 16 bit.

        Parameters
        ----------
        each
            Axis whose every index has a scale of its own; None: one for all.
        centred
            Whether the offset is 0, so that 0 stays exactly 0.
        """
        values = np.asarray(values, dtype=float)
        if values.size == 0:
            return {**self.add(values, "i2"), "scale": 1.0, "offset": 0.0}
        axes = None if each is None else tuple(k for k in range(values.ndim) if k != each % values.ndim)
        low, high = values.min(axis=axes, keepdims=True), values.max(axis=axes, keepdims=True)
        offset = np.zeros_like(low) if centred else (low + high) / 2
        half = np.maximum(high - offset, offset - low)
        scale = np.where(half > 0, half / TOP, 1.0)
        packed = self.add(np.rint((values - offset) / scale), "i2")
        numbers = {"scale": scale.ravel().tolist(), "offset": offset.ravel().tolist()}
        return {**packed, **numbers, "each": 0 if each is None else each % values.ndim}

    def add(self, values: Array | IntArray, kind: str) -> Packed:
        """Add an array as numbers of a kind: f4, u2, u4 or i2; what is there already is not added again."""
        packed = np.ascontiguousarray(values, dtype=f"<{kind}")
        raw = packed.tobytes()
        if packed.itemsize == 2:
            pairs = np.frombuffer(raw, np.uint8).reshape(-1, 2)
            raw = pairs[:, 0].tobytes() + pairs[:, 1].tobytes()
        key = hashlib.sha256(raw).digest()
        if key not in self.places:
            self.places[key] = self.size
            padding = -len(raw) % 4
            self.parts.append(raw + bytes(padding))
            self.size += len(raw) + padding
        return {"at": self.places[key], "type": kind, "shape": list(packed.shape)}

    def text(self) -> str:
        """Return all of it as text."""
        return base64.b64encode(zlib.compress(b"".join(self.parts), LEVEL)).decode("ascii")
