"""Arrays as text inside a page: one compressed block of bytes, and the location of each array in it.

quantised     value = offset + scale * n, with 16 bit integers n; one scale and offset, or one for each index of an axis
split         16-bit numbers as all low bytes, then all high bytes, which compress better than pairs
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

TOP = 32767  #: largest integer of 16 bits with sign
LEVEL = 6  #: compression level; 9 takes five times as long for 1 %

Packed = dict[str, Any]  #: at, type and shape (location and meaning); scale, offset and each for quantised numbers


@dataclass
class Block:
    """Consecutive arrays; the block grows as arrays are added."""

    parts: list[bytes] = field(default_factory=list)
    size: int = 0  #: bytes so far
    places: dict[bytes, int] = field(default_factory=dict)  #: location of each array, by the digest of its bytes

    def real(self, values: Array) -> Packed:
        """Add numbers as 32 bit floats."""
        return self.add(np.asarray(values), "f4")

    def whole(self, values: IntArray) -> Packed:
        """Add integers from 0, with 16 bit if they fit."""
        values = np.asarray(values)
        return self.add(values, "u2" if values.max(initial=0) < 65536 else "u4")

    def quantised(
        self, values: Array, *, each: int | None = None, centred: bool = False, steps: Array | None = None
    ) -> Packed:
        """Add numbers quantised to 16 bit.

        Parameters
        ----------
        each
            Axis with a separate scale for each index; None: one scale for all.
        centred
            Whether the offset is 0, so that 0 stays exactly 0.
        steps
            Sufficient step between numbers for each index of axis `each`. Small numbers then have small integers,
            which compress well; None: as fine as 16 bit allow.
        """
        values = np.asarray(values, dtype=float)
        if values.size == 0:
            return {**self.add(values, "i2"), "scale": 1.0, "offset": 0.0}
        axes = None if each is None else tuple(k for k in range(values.ndim) if k != each % values.ndim)
        low, high = values.min(axis=axes, keepdims=True), values.max(axis=axes, keepdims=True)
        offset = np.zeros_like(low) if centred else (low + high) / 2
        half = np.maximum(high - offset, offset - low)
        finest = half / TOP if steps is None else np.maximum(half / TOP, np.reshape(steps, half.shape))
        scale = np.where(half > 0, finest, 1.0)
        packed = self.add(np.rint((values - offset) / scale), "i2")
        numbers = {"scale": scale.ravel().tolist(), "offset": offset.ravel().tolist()}
        return {**packed, **numbers, "each": 0 if each is None else each % values.ndim}

    def add(self, values: Array | IntArray, kind: str) -> Packed:
        """Add an array as numbers of a type: f4, u2, u4 or i2; an array already present is not added again."""
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
        """Return the block as text."""
        return base64.b64encode(zlib.compress(b"".join(self.parts), LEVEL)).decode("ascii")
