"""A small reader of the pages that `ff.view` writes, by their documentation alone (docs/viewing.md)."""

import base64
import json
import zlib
from html.parser import HTMLParser

import numpy as np


class Parser(HTMLParser):
    """What a page is made of: tags with their attributes, and the text of those with an id."""

    def __init__(self):
        super().__init__()
        self.tags, self.texts, self.open = [], {}, None

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        self.open = dict(attributes).get("id") if tag == "script" else None

    def handle_endtag(self, tag):
        self.open = None

    def handle_data(self, data):
        if self.open is not None:
            self.texts[self.open] = self.texts.get(self.open, "") + data


class ReadPage:
    """The record of a page, and its arrays."""

    def __init__(self, path):
        self.text = path.read_text(encoding="utf-8")
        self.parser = Parser()
        self.parser.feed(self.text)
        self.record = json.loads(self.parser.texts["record"])
        self.bytes = zlib.decompress(base64.b64decode(self.parser.texts["numbers"]))

    def array(self, ref):
        """Return an array as the documentation says."""
        count, shape = int(np.prod(ref["shape"])), ref["shape"]
        part = self.bytes[ref["at"] :]
        if ref["type"] in ("f4", "u4"):
            return np.frombuffer(part[: 4 * count], "<" + ref["type"]).reshape(shape)
        low, high = (np.frombuffer(part[k * count : (k + 1) * count], np.uint8) for k in (0, 1))
        whole = low.astype(np.int64) + 256 * high.astype(np.int64)
        if ref["type"] == "u2":
            return whole.reshape(shape)
        whole = np.where(whole > 32767, whole - 65536, whole).reshape(shape).astype(float)
        if count == 0:
            return whole
        scale, offset = np.array(ref["scale"]), np.array(ref["offset"])
        if scale.size > 1:
            along = [1] * len(shape)
            along[ref["each"]] = -1
            scale, offset = scale.reshape(along), offset.reshape(along)
        return offset + scale * whole

    def places(self, number, row):
        """Return the nodes of a flexible surface in a row, ground axes, (n, 3)."""
        surface = self.record["surfaces"][number]
        body = self.record["bodies"][surface["body"]]
        shapes, nodes = self.array(surface["shapes"]), self.array(surface["nodes"])
        d = (self.array(body["a"])[row] @ shapes).reshape(-1, 3)
        w, x, y, z = self.array(body["p"])[row]
        u, v = np.array([x, y, z]), nodes + d
        turned = v + 2 * np.cross(u, np.cross(u, v) + w * v)
        return self.array(body["r"])[row] + turned

    def stress(self, number, row):
        """Return the stress at the nodes of a surface in a row, (n, 6)."""
        surface = self.record["surfaces"][number]
        a = self.array(self.record["bodies"][surface["body"]]["a"])[row]
        return (a @ self.array(surface["stress"])).reshape(-1, 6)
