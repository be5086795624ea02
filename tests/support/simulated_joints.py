"""Joints of simulated people under the names of any skeleton, and the silhouettes that cameras have of them."""

from contextlib import suppress

import cv2
import numpy as np
from rigs import cameras, ring

from tracker.formats.joint_maps import known_joint_maps
from tracker.formats.model_toml import load_model
from tracker.interchange.plausibility.examine import contradictions
from tracker.interchange.plausibility.filmed_people import FilmedMotion, FilmedPeople
from tracker.interchange.plausibility.readings import Reading, ReadPoints
from tracker.simulate.motion.postures import solve_posture
from tracker.simulate.motion.scenes import cast_of
from tracker.simulate.people.population import POPULATION
from tracker.simulate.people.skeleton import altered_model

FPS, N_FRAMES = 25.0, 50
SKELETONS = {m.name: m for m in known_joint_maps() if m.points}
UP = np.array([0.0, 0.0, 1.0])
WRONG_M = 0.05
"""Mean distance of the joints of limbs from which points that are stored are wrong: twice the error of a network."""
_SCENES = ("exercise", "dance", "reach_and_cross")
_PARTS = (("shoulder", "elbow", 0.05), ("elbow", "wrist", 0.04), ("hip", "knee", 0.08), ("knee", "ankle", 0.05))
_BONES = [(f"{side}_{a}", f"{side}_{b}", r) for side in ("left", "right") for a, b, r in _PARTS]
_BONES.append(("neck", "head", 0.08))


def simulated_person(seed, n_frames=N_FRAMES):
    """Points of the body of a person by name, (n_frames, 3) each, metres, and the height."""
    rng, poses = np.random.default_rng(seed), None
    while poses is None:
        person = ("", *POPULATION)[rng.integers(len(POPULATION) + 1)]
        role = cast_of(_SCENES[rng.integers(len(_SCENES))], int(rng.integers(10_000)), person)[0]
        model = altered_model(load_model("gavrila22", role.height_m), role.build.bone_factors)
        with suppress(AssertionError):  # a small body does not reach every step
            poses = solve_posture(role, model, n_frames, FPS)
    found = [model.named_points_world(pose) for pose in poses]
    out = {name: np.array([points[name] for points in found]) for name in found[0]}
    left = out["left_hip"] - out["right_hip"]
    forward = np.cross(left, UP) / np.linalg.norm(left, axis=1, keepdims=True)
    for side in ("left", "right"):
        sole = out[f"{side}_ankle"] - [0, 0, 0.035 * role.height_m]
        out[f"{side}_heel"] = sole - 0.03 * role.height_m * forward
        out[f"{side}_toe"] = sole + 0.1 * role.height_m * forward
    return out, role.height_m


def skeleton_points(person, joint_map):
    """All points of a skeleton, (n_frames, n_points, 3): fingers near the wrists, a face on the head, and so on."""
    counterparts = joint_map.counterparts(joint_map.points)
    return np.stack([_point(person, name, counterparts[name]) for name in joint_map.points], axis=1)


def _point(person, name, counterparts):
    if counterparts:
        return np.mean([person[p] for p in counterparts], axis=0)
    word = name.lower()
    side = "right" if word.startswith("r") else "left"
    pelvis = (person["left_hip"] + person["right_hip"]) / 2
    hand = person[f"{side}_wrist"] + 0.3 * (person[f"{side}_wrist"] - person[f"{side}_elbow"])
    collar = (person["neck"] + person[f"{side}_shoulder"]) / 2
    places = (
        (("hand", "thumb", "index", "middle", "ring", "pinky"), hand),
        (("olecranon", "fossa"), person[f"{side}_elbow"]),
        (("acromion",), person[f"{side}_shoulder"]),
        (("collar",), collar),
        (("toe", "foot"), person[f"{side}_toe"]),
        (("spine", "chest", "thorax"), (pelvis + person["neck"]) / 2),
        (("pelvis", "hip", "bodycenter"), pelvis),
        (("neck",), person["neck"]),
    )
    spread = 0.03 * np.array([len(word) % 3 - 1, sum(map(ord, word)) % 5 / 2 - 1, ord(word[-1]) % 4 / 2 - 0.75])
    found = next((place for words, place in places if any(w in word for w in words)), person["head"])
    return found + spread


def detected(points, seed, sigma_m=0.02, gross=0.03):
    """Points as a network finds them: with constant offsets, noise, and gross errors."""
    rng = np.random.default_rng((seed, 1))
    out = points + 0.012 * rng.normal(size=points.shape[1:]) + sigma_m * rng.normal(size=points.shape)
    wrong = rng.random(points.shape[:2]) < gross
    out[wrong] += 0.3 * rng.normal(size=(wrong.sum(), 3))
    return out


def filmed(person, seed, n_views=4):
    """The silhouettes of a person with a trunk, holes and clutter, as distances."""
    rng, views = np.random.default_rng((seed, 2)), [c.scaled(0.5) for c in cameras(ring(n_views))]
    n_frames, size, distances, flows = len(person["neck"]), views[0].size, [], []
    for camera in views:
        px = {name: camera.project(points) for name, points in person.items()}
        metre_px = camera.K[0, 0] / camera.depths(person["neck"])
        of_view = np.empty((n_frames, size[1], size[0]), np.uint8)
        for k in range(n_frames):
            mask = np.zeros((size[1], size[0]), np.uint8)
            trunk = [px[f"{side}_{joint}"][k] for side in ("left", "right") for joint in ("shoulder", "hip")]
            cv2.fillConvexPoly(mask, cv2.convexHull(np.round(trunk).astype(np.int32)), 1)
            for a, b, radius_m in _BONES:
                ends = [tuple(int(x) for x in np.round(px[n][k])) for n in (a, b)]
                cv2.line(mask, *ends, 1, max(2, round(2 * radius_m * metre_px[k])))
            for value in (0, 1):  # holes and clutter
                cv2.circle(mask, tuple(int(x) for x in rng.integers((0, 0), size)), int(rng.integers(2, 9)), value, -1)
            of_view[k] = np.minimum(np.round(cv2.distanceTransform(1 - mask, cv2.DIST_L2, 3)), 255)
        distances.append(of_view)
        flows.append(np.stack([_flow(px, k, size, rng) for k in range(n_frames - 1)]).astype(np.float16))
    motion = FilmedMotion(tuple(views), tuple(flows), 1)
    return FilmedPeople(tuple(views), tuple(distances), np.ones((n_frames, n_views), dtype=bool), motion)


def _flow(px, k, size, rng, sigma_px=0.5):
    """How the limbs of a person move in a picture, at every fourth pixel, with noise."""
    flow = np.zeros((-(-size[1] // 4), -(-size[0] // 4), 2), np.float32)
    for a, b, _ in _BONES:
        for share in np.linspace(0, 1, 5):
            at, after = (px[a][i] * (1 - share) + px[b][i] * share for i in (k, k + 1))
            center = tuple(int(x) for x in np.round(at / 4))
            cv2.circle(flow, center, 2, tuple(float(x) for x in after - at), -1)
    return flow + sigma_px * rng.normal(size=flow.shape)


class Case:
    """A person whose true points a file has, in the order of a skeleton."""

    def __init__(self, seed):
        self.person, self.height_m = simulated_person(seed)
        self.film = filmed(self.person, seed)
        self.skeleton = [*SKELETONS.values()][seed % len(SKELETONS)]
        self.clean = skeleton_points(self.person, self.skeleton)
        self.points = detected(self.clean, seed)
        self.rng = np.random.default_rng((seed, 3))
        self.stated_m = self.height_m * float(np.exp(0.05 * self.rng.normal()))

    def found(self, points, skeleton=None, axes="x,y,z", in_space=True, known_people=None, is_everybody=True):
        """Reasons against points that are read as a skeleton, by default their own."""
        given = Reading(skeleton or self.skeleton, axes)
        same_size = [m for m in SKELETONS.values() if len(m.points) == len(given.joint_map.points)]
        maps = [given.joint_map, *(m for m in same_size if m.name != given.joint_map.name)]
        frames = np.arange(len(points))
        people = known_people or self.film
        read = ReadPoints((), points[:, None], frames, (self.stated_m,), UP, FPS, people, is_everybody)
        return contradictions(read, given, maps, 0, in_space)
