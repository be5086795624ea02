"""glTF 2.0 in one binary file (GLB): skeletons of nodes with the shapes of their parts, and one animation of all.

A node is a joint, in the frame of the part that it moves; the shape of the part is a mesh below it. Landmarks are nodes
without a mesh. y points up, lengths are metres.
"""

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.geometry import rigid
from tracker.geometry.arrays import Array

_MAGIC, _JSON_CHUNK, _BINARY_CHUNK = b"glTF", b"JSON", b"BIN\0"
"""Names in the binary container (glTF 2.0 Sect. 4.4)."""


_OF_ANIMATION = ("channels", "samplers")
_KINDS = ("nodes", "meshes", "materials", "accessors", "bufferViews", *_OF_ANIMATION)


class ComponentType(IntEnum):
    """Types of components (glTF 2.0 Sect. 5.1.3)."""

    UNSIGNED_INT = 5125
    FLOAT = 5126


class BufferTarget(IntEnum):
    """Targets of the views of meshes (glTF 2.0 Sect. 5.11.5)."""

    VERTICES = 34962
    INDICES = 34963


@dataclass(frozen=True, eq=False)
class AnimatedBody:
    """A body and its motion."""

    name: str
    """Of the person."""
    model: BodyModel
    poses: Array
    """One for each time, (n, n_values)."""
    times_s: Array
    """(n,), ascending, not negative. Programs interpolate between them."""


@dataclass
class _Document:
    """A file while it is put together."""

    rows: dict[str, list[dict[str, Any]]] = field(default_factory=lambda: {kind: [] for kind in _KINDS})
    """Content of each kind."""
    binary: bytearray = field(default_factory=bytearray)

    def add(self, kind: str, **content: Any) -> int:
        """Add something of a kind, and return its index."""
        self.rows[kind].append(content)
        return len(self.rows[kind]) - 1

    def add_node(self, parent: int | None, **content: Any) -> int:
        """Add a node below another one, and return its index."""
        node = self.add("nodes", **content)
        if parent is not None:
            self.rows["nodes"][parent].setdefault("children", []).append(node)
        return node

    def add_array(
        self, values: NDArray[Any], kind: str, target: BufferTarget | None = None, bounds: bool = False
    ) -> int:
        """Add an array, (n,) or (n, m), as an accessor, and return its index.

        Args:
            values: floats or whole numbers.
            kind: `SCALAR`, `VEC3` or `VEC4`.
            target: one of `BufferTarget`; None for an animation.
            bounds: whether to state the least and largest values.
        """
        is_float = values.dtype.kind == "f"
        data = np.ascontiguousarray(values, np.float32 if is_float else np.uint32)
        component = ComponentType.FLOAT if is_float else ComponentType.UNSIGNED_INT
        use = {} if target is None else {"target": target}
        view = self.add("bufferViews", buffer=0, byteOffset=len(self.binary), byteLength=data.nbytes, **use)
        self.binary += data.tobytes()
        columns = data.reshape(len(data), -1)
        limits = {"min": columns.min(axis=0).tolist(), "max": columns.max(axis=0).tolist()} if bounds else {}
        return self.add("accessors", bufferView=view, componentType=component, count=len(data), type=kind, **limits)

    def animate(self, node: int, path: str, times: int, values: Array) -> None:
        """Animate a node: its `rotation`, (n, 4), x, y, z, w, or its `translation`, (n, 3).

        Args:
            node: index.
            path: of glTF.
            times: index of the accessor of the times.
            values: at these times.
        """
        output = self.add_array(values, "VEC4" if path == "rotation" else "VEC3")
        sampler = self.add("samplers", input=times, interpolation="LINEAR", output=output)
        self.add("channels", sampler=sampler, target={"node": node, "path": path})


def write_glb(path: Path, title: str, bodies: Sequence[AnimatedBody], T_file_world: Array) -> None:
    """Write the motion of some bodies.

    Args:
        path: the file.
        title: of the scene and the animation.
        bodies: with at least one pose each.
        T_file_world: maps the world to the axes of the file, (4, 4), metres.

    Raises:
        OSError: the file cannot be written.
    """
    document = _Document()
    roots = [_add_body(document, body, T_file_world) for body in bodies]
    content = {
        "asset": {"version": "2.0", "generator": "Quadrille"},
        "scene": 0,
        "scenes": [{"name": title, "nodes": roots}],
        **{kind: document.rows[kind] for kind in _KINDS if kind not in _OF_ANIMATION},
        "animations": [{"name": title} | {kind: document.rows[kind] for kind in _OF_ANIMATION}],
        "buffers": [{"byteLength": len(document.binary)}],
    }
    chunks = _chunk(_JSON_CHUNK, json.dumps(content, allow_nan=False).encode(), b" ")
    chunks += _chunk(_BINARY_CHUNK, bytes(document.binary), b"\0")
    path.write_bytes(struct.pack("<4sII", _MAGIC, 2, 12 + len(chunks)) + chunks)


def _chunk(name: bytes, data: bytes, padding: bytes) -> bytes:
    """Return a chunk of the container, padded to whole words."""
    data += padding * (-len(data) % 4)
    return struct.pack("<I4s", len(data), name) + data


def _add_body(document: _Document, body: AnimatedBody, T_file_world: Array) -> int:
    """Add a body with its meshes and its animation, and return the index of its root node."""
    model = body.model
    root = document.add_node(None, name=body.name)
    times = document.add_array(body.times_s, "SCALAR", bounds=True)
    Ts_world = np.array([model.kinematics(values).Ts_world_part for values in body.poses])
    nodes: list[int] = []
    for i, joint in enumerate(model.joints):
        parent = model.parents[i]
        above = (
            np.broadcast_to(rigid.inverse(T_file_world), (len(Ts_world), 4, 4)) if parent < 0 else Ts_world[:, parent]
        )
        Ts = rigid.inverse(above) @ Ts_world[:, i]
        rotations, translations = _continuous_quaternions(Ts[:, :3, :3]), Ts[:, :3, 3]
        node = document.add_node(
            root if parent < 0 else nodes[parent],
            name=joint.name, rotation=rotations[0].tolist(), translation=translations[0].tolist(),
        )  # fmt: skip
        nodes.append(node)
        document.animate(node, "rotation", times, rotations)
        if parent < 0 or joint.free:
            document.animate(node, "translation", times, translations)
    _add_points(document, model, nodes)
    _add_meshes(document, model, nodes)
    return root


def _add_points(document: _Document, model: BodyModel, nodes: Sequence[int]) -> None:
    """Add a node for each landmark, and for each joint whose anatomical centre is beside its pivot."""
    n_joints = len(model.joints)
    for i, landmark in enumerate(model.landmarks):
        at = model.points_part[n_joints + i] + model.center_offsets[n_joints + i]
        document.add_node(nodes[model.part_index[landmark.part]], name=landmark.name, translation=at.tolist())
    for i, joint in enumerate(model.joints):
        if model.center_offsets[i].any():
            pivot = model.tree.offsets[i] if model.parents[i] >= 0 else np.zeros(3)
            at = pivot + model.center_offsets[i]
            document.add_node(nodes[int(model.proximal_parts[i])], name=f"{joint.name}_center", translation=at.tolist())


def _add_meshes(document: _Document, model: BodyModel, nodes: Sequence[int]) -> None:
    """Add the shape of each part below the node of its joint."""
    for i, (part, shape) in enumerate(zip(model.parts, model.shapes, strict=True)):
        points, triangles = shape.triangles()
        attributes = {
            "POSITION": document.add_array(points + model.centers_part[i], "VEC3", BufferTarget.VERTICES, bounds=True)
        }
        indices = document.add_array(triangles.ravel().astype(np.uint32), "SCALAR", BufferTarget.INDICES)
        material = document.add("materials", name=part.name, pbrMetallicRoughness=_finish(part.color))
        primitive = {"attributes": attributes, "indices": indices, "material": material}
        mesh = document.add("meshes", name=part.name, primitives=[primitive])
        document.add_node(nodes[i], name=f"{part.name}_shape", mesh=mesh)


def _finish(color: str) -> dict[str, Any]:
    """Return a matt surface of a colour `#rrggbb`. glTF has linear colours: the curve is that of sRGB."""
    srgb = np.frombuffer(bytes.fromhex(color[1:]), np.uint8) / 255
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return {"baseColorFactor": [*np.round(linear, 4).tolist(), 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0}


def _continuous_quaternions(R: Array) -> Array:
    """Return rotations, (n, 3, 3), as quaternions x, y, z, w, (n, 4), none opposite to the one before."""
    wxyz = rigid.quaternion_from_matrix(R)
    turned = np.cumprod(np.where(np.sum(wxyz[1:] * wxyz[:-1], axis=1) < 0, -1.0, 1.0))
    wxyz[1:] *= turned[:, None]
    return np.asarray(wxyz[:, (1, 2, 3, 0)])
