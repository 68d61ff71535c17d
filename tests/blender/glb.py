"""Reads what Blender's exporter has written: the JSON and the arrays of a .glb file."""

import json
import struct

import numpy as np

TYPES = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class Glb:
    def __init__(self, path):
        data = path.read_bytes()
        size = struct.unpack("<I", data[12:16])[0]
        self.json, self._binary = json.loads(data[20 : 20 + size]), data[28 + size :]

    def array(self, accessor):
        """The rows (count, width) of an accessor, as numbers of 0..1 where they are normalized."""
        entry = self.json["accessors"][accessor]
        view = self.json["bufferViews"][entry["bufferView"]]
        kind, width = np.dtype(TYPES[entry["componentType"]]), WIDTHS[entry["type"]]
        start = view.get("byteOffset", 0) + entry.get("byteOffset", 0)
        rows = np.frombuffer(self._binary, kind, entry["count"] * width, start).reshape(-1, width)
        return rows / np.iinfo(kind).max if entry.get("normalized") else rows

    def primitives(self, name):
        """The primitives of the node of that name."""
        node = next(node for node in self.json["nodes"] if node["name"] == name)
        return self.json["meshes"][node["mesh"]]["primitives"]

    def extras(self, name):
        node = next(node for node in self.json["nodes"] if node["name"] == name)
        return self.json["meshes"][node["mesh"]].get("extras", {})

    def corners(self, name, attribute):
        """Positions (C, 3) in Blender's axes and values (C, c) of an attribute at all triangles' corners of a node."""
        places, values = [], []
        for primitive in self.primitives(name):
            rows = self.array(primitive["indices"])[:, 0]
            x, y, z = self.array(primitive["attributes"]["POSITION"])[rows].T
            places.append(np.stack([x, -z, y], axis=1))
            values.append(self.array(primitive["attributes"][attribute])[rows])
        return np.concatenate(places), np.concatenate(values)

    def material(self, name):
        return next(entry for entry in self.json["materials"] if entry["name"] == name)
