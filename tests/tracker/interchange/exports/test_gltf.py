"""glTF files: joint centres sampled from the animation, meshes read by trimesh, the Khronos validator."""

import json

import numpy as np
import pytest
import trimesh
from bodies import MODELS, with_center
from gltf_validator import check_gltf
from stored_motions import FPS, store_motion

from tracker.geometry import rigid
from tracker.interchange.exports import writers
from tracker.interchange.exports.motion import ExportOptions, file_from_world, read_motion

WIDTH = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


class Sampled:
    """A file's nodes at any time, by the rules of glTF 2.0."""

    def __init__(self, path):
        data = path.read_bytes()
        assert data[:4] == b"glTF"
        assert int.from_bytes(data[8:12], "little") == len(data)
        n = int.from_bytes(data[12:16], "little")
        self.content = json.loads(data[20 : 20 + n])
        self.binary = data[28 + n :]
        (animation,) = self.content["animations"]
        self.channels = []
        for channel in animation["channels"]:
            sampler, target = animation["samplers"][channel["sampler"]], channel["target"]
            arrays = self.array(sampler["input"]), self.array(sampler["output"])
            self.channels.append((target["node"], target["path"], *arrays))

    def array(self, accessor):
        found = self.content["accessors"][accessor]
        view = self.content["bufferViews"][found["bufferView"]]
        raw = self.binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        values = np.frombuffer(raw, {5126: "<f4", 5125: "<u4"}[found["componentType"]])
        return values.reshape(found["count"], WIDTH[found["type"]]).astype(float)

    def at(self, time):
        """Positions of the nodes of each person by name."""
        nodes = [dict(node) for node in self.content["nodes"]]
        for node, path, times, values in self.channels:
            after = min(int(np.searchsorted(times[:, 0], time)), len(times) - 1)
            before = max(after - 1, 0)
            span = times[after, 0] - times[before, 0]
            share = np.clip((time - times[before, 0]) / span, 0, 1) if span else 0.0
            ends = values[before], values[after]
            nodes[node][path] = slerp(*ends, share) if path == "rotation" else (1 - share) * ends[0] + share * ends[1]
        return {nodes[r]["name"]: self.below(nodes, r, np.eye(4)) for r in self.content["scenes"][0]["nodes"]}

    def below(self, nodes, index, T_parent):
        node = nodes[index]
        x, y, z, w = node.get("rotation", (0, 0, 0, 1))
        T = T_parent @ rigid.transform(rigid.matrix_from_quaternion(np.array([w, x, y, z])), node.get("translation"))
        out = {node["name"]: T[:3, 3]}
        for child in node.get("children", ()):
            out |= self.below(nodes, child, T)
        return out


def slerp(a, b, share):
    cos = abs(float(a @ b))
    b = b if a @ b >= 0 else -b
    angle = np.arccos(min(cos, 1.0))
    if angle < 1e-6:
        return (1 - share) * a + share * b
    return (np.sin((1 - share) * angle) * a + np.sin(share * angle) * b) / np.sin(angle)


def exported(tmp_path, models, **changes):
    session, truth = store_motion(tmp_path / "s", models, **changes)
    people = tuple(range(len(models)))
    writers.write_animation(read_motion(session, people), ExportOptions("y-up"), [tmp_path / "a.glb"], lambda: None)
    return session, truth, tmp_path / "a.glb"


QUICK = ("gavrila38", "balls")


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.slow] * (n not in QUICK)) for n in sorted(MODELS)])
def test_joint_centers_of_the_animation_are_where_they_are(tmp_path, name):
    model = with_center(MODELS[name], MODELS[name].joints[1].name, (0.01, 0.02, -0.03))
    model = with_center(model, model.landmarks[0].name, (0.0, 0.02, 0.0))
    session, truth, path = exported(tmp_path, [model, MODELS["gavrila22"]], gaps={(0, 3)}, up="-y", seed=3)
    file, T = Sampled(path), file_from_world(session, "y-up")
    moved = {f"{j.name}_center" for j in model.joints if any(j.center_offset)}
    for person, bodies in zip(("ann", "bob"), truth, strict=True):
        for frame, body in bodies.items():
            found = file.at(frame / FPS)[person]
            centers = dict(zip(body.model.point_names, rigid.apply(T, body.joint_centers_world), strict=True))
            errors = {
                p: np.linalg.norm(found[f"{p}_center" if f"{p}_center" in found else p] - place)
                for p, place in centers.items()
            }
            assert max(errors.values()) < 1e-4, errors
            assert person == "bob" or moved <= found.keys()
    between = file.at(3 / FPS)["ann"]  # a gap: half way, not a jump
    assert all(np.isfinite(p).all() for p in between.values())


def test_trimesh_finds_the_shapes_where_the_body_is(tmp_path):
    session, truth, path = exported(tmp_path, [MODELS["gavrila38"]], n_frames=3)
    scene = trimesh.load(path)
    body, T = truth[0][0], file_from_world(session, "y-up")
    assert len(scene.geometry) == len(body.model.parts)
    for i, part in enumerate(body.model.parts):
        at, geometry = scene.graph[f"{part.name}_shape"]
        points = trimesh.transform_points(scene.geometry[geometry].vertices, at)
        shape = body.model.shapes[i].triangles().vertices + body.model.centers_part[i]
        expected = rigid.apply(T, rigid.apply(body.kinematics.Ts_world_part[i], shape))
        np.testing.assert_allclose(points.min(axis=0), expected.min(axis=0), atol=1e-4)
        np.testing.assert_allclose(points.max(axis=0), expected.max(axis=0), atol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("models", [["gavrila38"], ["gavrila22_cones", "balls"], ["knossow54", "mikic10", "gavrila34"]])
def test_the_khronos_validator_finds_no_error(tmp_path, models):
    _, _, path = exported(tmp_path, [MODELS[m] for m in models], gaps={(0, 3)})
    check_gltf(path)
