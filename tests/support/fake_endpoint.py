"""The smallest program that speaks the pane socket (docs/protocol.md): a stick figure.

Messages in both directions are checked against their declarations.

It stands in for the controller in tests of the page alone; `python tests/support/fake_endpoint.py` serves it on a port.
"""

import asyncio
import contextlib
import functools
import itertools
import json
import struct
import sys
from dataclasses import dataclass, field

import cv2
import msgspec
import numpy as np
from aiohttp import WSMsgType, web
from declared_messages import checked

from app.messages.parsing import parse
from app.page.feeds.inspector import methods

WIDTH, HEIGHT, N_FRAMES = 640, 480, 120
CAMERA_NAMES = ("FRONT", "RIGHT", "BACK", "LEFT")
COLORS = ("#ffb454", "#6ccbff", "#8be06a", "#ff8fa3", "#c9a6ff", "#ffe066", "#5ee0c8", "#ff9df2")
REST = {
    "torso": (0.0, 0.25, 0.0),
    "waist": (0.0, 0.18, 0.0),
    "head": (0.0, 1.0, 0.0),
    "l_shoulder": (0.3, 0.7, 0.0),
    "l_elbow": (0.62, 0.55, 0.1),
    "l_wrist": (0.9, 0.7, 0.2),
    "r_shoulder": (-0.3, 0.7, 0.0),
    "r_elbow": (-0.62, 0.55, 0.1),
    "r_wrist": (-0.9, 0.7, 0.2),
    "l_hip": (0.17, -0.1, 0.0),
    "l_knee": (0.2, -0.7, 0.08),
    "r_hip": (-0.17, -0.1, 0.0),
    "r_knee": (-0.2, -0.7, 0.08),
}
BONES = [
    ("l_shoulder", "l_elbow"), ("l_elbow", "l_wrist"), ("r_shoulder", "r_elbow"), ("r_elbow", "r_wrist"),
    ("l_hip", "l_knee"), ("r_hip", "r_knee"), ("torso", "head"), ("l_shoulder", "r_shoulder"), ("l_hip", "r_hip"),
]  # fmt: skip
SIDES = {"l_": "left", "r_": "right"}
SCALE = 150.0
HIDDEN_LINE = np.column_stack([np.arange(100, 300), np.full(200, 60), np.arange(101, 301), np.full(200, 60)])
"""What the layer of hidden contours shows: a line of short pieces, px."""
NO_TRACK = {
    "running": False, "first": None, "last": None, "at": None, "done": 0, "total": 0, "stage": "tracking",
    "message": "",
}  # fmt: skip
DISAGREEING = [44, 45]
AMBIGUOUS = (71, 72)
NO_RANGE = {"running": False, "what": "", "done": 0, "total": 0, "message": ""}
STAGES = ["torso_head", "arms", "legs"]
SOURCES = ["manual", "searched", "searched", "tracked", "tracked", "tracked", "interpolated", "smoothed"]
LIMBS = ["left arm", "right arm", "left leg", "right leg", "head"]
LIMBS_LOST = {"doubtful": [0.01, 0.31, 0.0, 0.02, 0.0], "lost": [0.97, 0.04, 0.0, 0.0, 0.01]}
"""Probabilities of the limbs of a frame by its status."""
PARTS = ["torso", "left_arm", "left_leg", "head", "right_leg", "right_arm", "pelvis"]
DOFS = [{"joint": "torso", "name": name, "unit": "cm", "low": None, "high": None} for name in ("x", "y", "z")] + [
    {"joint": "l_elbow", "name": "extension", "unit": "deg", "low": 0.0, "high": 155.0},
    *(
        {"joint": "torso", "name": n, "unit": "deg", "low": None, "high": None}
        for n in ("abduction", "elevation", "twist")
    ),
]
ANGLES = ("abduction", "elevation", "twist", "extension")
PLOTS = {
    "arms": [("Left arm", "deg", ANGLES, (4, 5, 6, 3)), ("Right arm", "deg", ANGLES, (7, 8, 9, 10))],
    "legs": [("Left leg", "deg", ANGLES, (11, 12, 13, 14)), ("Right leg", "deg", ANGLES, (15, 16, 17, 18))],
    "torso": [("Angles", "deg", ANGLES[:3], (4, 5, 6)), ("Position", "cm", ("x", "y", "z"), (0, 1, 2))],
    "cost": [("Cost", "px", ("mean", *CAMERA_NAMES), ())],
}
TRACK = {"method": "chamfer", "stride": 1, "cameras": [], "options": {}}
SEARCH = {
    "theta_px": None, "outliers": "truncated", "passes": [1.0, 0.5], "patience": 3, "max_expansions": 60,
    "limbs_apart": False, "bound_rad": 0.2618, "bound_m": 0.1, "step_rad": 0.0873, "step_m": 0.05,
}  # fmt: skip
VIEW_3D = {
    "bodies": True, "colors": "parts", "opacity": 1.0, "cameras": True, "images": True, "floor": True, "gizmos": True,
    "ghost": False, "voxels": False, "character": "", "trail_points": [], "trail_frames": 25,
}  # fmt: skip
BODY_SIZES = {
    "type": "body_sizes", "person": 0, "body": "gavrila34", "bodies": ["gavrila34", "gavrila38"], "height_m": 1.7,
    "sides_alike": True, "edited": False, "has_former": False,
    "outcome": "", "height_limits_m": [0.3, 3.0], "size_limits_m": [0.005, 1.19],
    "parts": [
        {"name": name, "length_m": 0.3, "half_depth_m": 0.05, "half_width_m": 0.06}
        for name in ("torso", "left_forearm", "right_forearm")
    ],
    "widths": [{"name": "hip", "width_m": 0.17}],
}  # fmt: skip
REMARK = "left arm relocated"


def encoded(message):
    """The JSON of a message to the page; fails if the message does not fit its declaration."""
    text = json.dumps(message)
    checked(text)
    return text


def status_of(frame):
    """Frames 31 and 32 are doubtful, 50 is lost; there is no pose from 100 on."""
    return "doubtful" if frame in (31, 32) else "lost" if frame == 50 else "good"


def limb_of(point):
    """Display name of the limb of a point."""
    side, _, joint = point.partition("_")
    if not joint:
        return "head" if point == "head" else "body"
    return f"{SIDES[side + '_']} {'leg' if joint in ('hip', 'knee') else 'arm'}"


def curve(index, frame):
    """Value of a curve: twists wrap at half a turn, the gap from frame 60 to 64 has none."""
    value = 90.0 + 60 * np.sin(frame / 9 + index) if index % 4 != 2 else (7.0 * frame + 180) % 360 - 180
    return np.where((frame >= 100) | ((frame >= 60) & (frame < 65)), np.nan, value)


def project(points, camera):
    """Orthographic views from four sides, (N, 3) to (N, 2) undistorted pixels."""
    angle = camera * np.pi / 2
    x = points[:, 0] * np.cos(angle) + points[:, 2] * np.sin(angle)
    return np.stack([WIDTH / 2 + SCALE * x, HEIGHT / 2 + 20 - SCALE * points[:, 1]], axis=-1)


@dataclass
class FakeEndpoint:
    """Answers pane sockets; one state for all of them."""

    n_people: int = 1
    has_outlines: bool = True
    n_cameras: int = 4
    overlay_delay_s: float = 0.0
    """How long each overlay takes, to try what a slow program does."""
    image_delay_s: float = 0.0
    held: asyncio.Event | None = None
    """Images are kept back until it is set; None: none are."""
    n_frames: int = N_FRAMES
    role: str = "host"
    """Of the page's link."""
    n_guests: int = 0
    """Number of others who are on the session."""
    name_asked: str = ""
    """Name by which the last page joined."""
    received: list = field(default_factory=list)
    """Every message of every page, but for what each says when it connects."""
    frame_s: float = 0.05
    """How long a run takes for a frame."""
    sending: asyncio.Lock = field(default_factory=asyncio.Lock, repr=False)
    """Held while a frame is sent."""
    greetings: list = field(default_factory=list)
    """What the pages said when they connected."""
    asked: list = field(default_factory=list)
    """What the pages asked about where poses come from, as the pointer passes joints."""
    views: list = field(default_factory=list)
    """What the pages said that they show."""
    sizes: tuple = ((WIDTH, HEIGHT),)
    """Of the cameras' images, px; in turn, where there are more cameras."""
    sockets: set = field(default_factory=set)
    thumbnails: list = field(default_factory=list)
    """Addresses of the thumbnails that the pages requested."""
    walk_m: float = 0.0
    """How far the people walk from a frame to the next."""
    start: str = "first"
    """Identifies the start of the pretended program."""
    name: str = "elbow_rotation"
    """Of the session."""
    sources: tuple = tuple(SOURCES)
    """Of the poses, in turn each ten frames."""

    def __post_init__(self):
        self.pose = {(p, name): np.add(at, (0.9 * p, 0, 0)) for p in range(self.n_people) for name, at in REST.items()}
        self.before_drag = self.out_of_reach = None
        self.held_joints = set()
        self.sides_line = False  # whether there is a line of each side
        self.hider = None  # index of the person who occludes what is not visible
        self.other_kind = None  # kind of another pose that is drawn
        self.seq = 0
        self.epipolar_of = None
        self.set_numbers = itertools.count(1)
        self.search_task = None
        self.track_task = None
        self.curves_group = None
        self.state = {
            "type": "state", "frame": 12, "person": 0, "point": None,
            "cost_px": 1.47, "view_costs_px": [0.84, 1.1, 2.31, None, *[1.0] * self.n_cameras][: self.n_cameras],
            "source": "manual", "status": "", "remark": "", "is_checked": False, "part_costs_px": [],
            "expected_errors_m": [], "replay": None,
            "compared": None, "view_across": None, "compared_run": None, "preview": None,
            "job": self.idle_job(""),
            "track": dict(NO_TRACK), "range": dict(NO_RANGE), "follow": True, "undo": "drag l_wrist", "redo": None,
            "dofs": [1.0, 2.0, 90.0, 30.0, 4.0, 5.0, 6.0], "locked": [], "other_sizes": False, "solo": False,
            "people": [
                {"source": "manual", "status": "", "shown": True, "alternatives": 0} for _ in range(self.n_people)
            ],
            "snapped": None, "floor": None, "compiling": None,
            "saved": True, "save_error": None,
        }  # fmt: skip

        self.settings = {"type": "settings", "methods": msgspec.to_builtins(methods())} | {
            name: dict(values)
            for values, names in ((TRACK, ("track", "track_default")), (SEARCH, ("search", "search_default")))
            for name in names
        }
        self.view_3d = {
            "type": "view_3d", "view": dict(VIEW_3D), "prediction": "", "trail_points": ["head", "l_wrist"],
            "characters": ["gavrila34", "knossow54"],
            "floor": {"up": "y", "tilt_deg": None, "height_m": None, "origin": "", "has_former": False},
        }  # fmt: skip
        self.body_sizes = dict(BODY_SIZES)

    def idle_job(self, message):
        return {
            "running": False, "kind": None, "stage": None, "evaluations": 0, "message": message,
        }  # fmt: skip

    @property
    def presence(self):
        """Who is there: the host on frame 0, and the page if it is not the host's."""
        host = {"name": "Anna", "role": "host", "frame": 0, "person": 0, "doing": "", "is_self": self.role == "host"}
        own = {**host, "name": self.name_asked, "role": self.role, "frame": 12, "is_self": True}
        guests = [{**host, "name": f"Guest {i}", "role": "look", "is_self": False} for i in range(self.n_guests)]
        people = [host, *guests, *([own] if self.name_asked and self.role != "host" else [])]
        name = "Anna" if self.role == "host" else self.name_asked
        return {"type": "presence", "name": name, "refusal": "", "link": self.role, "people": people}

    def heard(self, kind):
        """All messages of a type, in order."""
        return [m for m in self.received if m["type"] == kind]

    async def serve(self, socket, role, name=""):
        self.name_asked = name
        self.sockets.add(socket)
        self.seq = 0
        try:
            await self.send_all(socket)
            async for message in socket:
                if message.type is WSMsgType.TEXT:
                    parse(message.data)
                    told = json.loads(message.data)
                    apart = {"pause_3d": self.greetings, "view": self.views, "provenance": self.asked}
                    apart.get(told["type"], self.received).append(told)
                    await self.answer(told)
        finally:
            self.sockets.discard(socket)

    async def rest(self):
        """End what it does by itself."""
        for task in filter(None, (self.search_task, self.track_task)):
            task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await task

    async def answer(self, message):
        match message["type"]:
            case "seek":
                self.state |= self.judged(message["frame"])
                if self.state["track"]["running"]:
                    self.state["follow"] = False
                await self.broadcast(self.state)
                await self.send_frame()
            case "select" | "people":
                await self.cast(message)
            case "view":
                await self.send_frame()
            case "drag":
                await self.drag(message)
            case "pose" if message["action"] == "hold":
                await self.hold(message)
            case "search":
                await self.search(message["action"])
            case "track":
                await self.track(message["action"], message.get("until"))
            case "follow" | "snap" | "before":
                await self.switch(message)
            case "range":
                await self.review(message)
            case "curves":
                self.curves_group = message["group"]
                if self.curves_group:
                    await self.send_curves(np.arange(self.n_frames), replace=True)
            case "undo" | "redo":
                await self.broadcast(self.state)

    async def switch(self, message):
        match message["type"]:
            case "follow":
                self.state["follow"] = message["follow"]
            case "snap":
                self.state["snapped"] = message["camera"]
            case "before":
                self.state["compared"] = dict(self.state["compared"], is_before_shown=message["shown"])
        await self.broadcast(self.state)

    async def review(self, message):
        """Mark the poses of a range as reviewed; other work on ranges is only heard."""
        if message["action"] != "reviewed":
            return
        cells = {k: self.cell(k) | {"reviewed": True} for k in range(message["first"], message["last"] + 1)}
        for person in (None, *((message["person"],) if self.n_people > 1 else ())):
            await self.broadcast({"type": "timeline", "person": person, "cells": cells, "replace": False})

    async def hold(self, message):
        change = self.held_joints.add if message["held"] else self.held_joints.discard
        change((message["person"], message["point"]))
        await self.send_overlay()

    async def cast(self, message):
        if message["type"] == "select":
            self.state |= {"person": message["person"], "point": message["point"]}
        elif message["action"] == "solo":
            self.state["solo"] = message["on"]
        else:
            self.state["people"][message["person"]]["shown"] = message["shown"]
        await self.broadcast(self.state)

    async def drag(self, message):
        key = (message["person"], message["point"])
        self.seq = message["seq"]
        if message["phase"] == "start":
            self.before_drag = {k: v.copy() for k, v in self.pose.items()}
        elif message["phase"] == "cancel":
            self.pose = self.before_drag
        angle = message["camera"] * np.pi / 2
        right = np.array([np.cos(angle), 0, np.sin(angle)])
        x = (message["u"] - WIDTH / 2) / SCALE
        y = (HEIGHT / 2 + 20 - message["v"]) / SCALE
        if message["phase"] in ("move", "end"):
            point = self.pose[key]
            moved = right * (x - point @ right) + np.array([0, y - point[1], 0])
            for other in self.pose:
                if other == key or (key[1] == "torso" and other[0] == key[0]):
                    self.pose[other] = self.pose[other] + moved
        self.epipolar_of = (message["camera"], y) if message["phase"] in ("start", "move") else None
        await asyncio.sleep(self.overlay_delay_s)
        await self.send_overlay()
        if message["phase"] == "end":
            self.state |= {"undo": f"drag {message['point']}", "source": "manual"}
            await self.broadcast(self.state)

    async def search(self, action):
        if self.search_task:
            self.search_task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self.search_task
            self.search_task = None
        if action == "frame":
            self.search_task = asyncio.create_task(self.run_search())
            return
        job = self.idle_job("Stopped at 1.21 px after 512 poses")
        if action == "step":
            job |= {"kind": "step", "stage": "torso_head", "evaluations": 11}
        self.state["job"] = job
        await self.broadcast(self.state)

    def judged(self, frame):
        """What the state says of a frame."""
        status = status_of(frame)
        remark = REMARK if status == "doubtful" else ""
        parts = [0.8, 4.5, 1.5, 1.2, 2.5, None, 0.9]
        return {"frame": frame, "status": status, "remark": remark, "part_costs_px": parts}

    async def track(self, action, until):
        if self.track_task:
            self.track_task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self.track_task
            self.track_task = None
        track = self.state["track"]
        if action in ("forward", "backward"):
            step = 1 if action == "forward" else -1
            first = self.state["frame"] + step
            end = (self.n_frames - 1 if step > 0 else 0) if until is None else until
            self.state |= {"follow": True}
            track |= NO_TRACK | {"first": first, "last": end, "total": abs(end - first) + 1, "running": True}
        elif action == "stop":
            track |= NO_TRACK | {"message": f"stopped: {track['done']} frames"}
        else:
            track["running"] = action == "resume"
        if track["running"]:
            self.track_task = asyncio.create_task(self.run_track())
        await self.broadcast(self.state)

    async def run_track(self):
        """A frame after the other, at an even pace."""
        track = self.state["track"]
        step = 1 if track["last"] >= track["first"] else -1
        at = track["first"] if track["at"] is None else track["at"] + step
        for frame in range(at, track["last"] + step, step):
            track |= {"at": frame, "done": track["done"] + 1}
            cell = {
                "source": "tracked",
                "cost_px": 1.0,
                "keyframe": False,
                "status": status_of(frame),
                "remark": "",
                "reviewed": False,
                "ambiguous": False,
                "limbs_lost": LIMBS_LOST.get(status_of(frame), []),
            }
            await self.broadcast({"type": "timeline", "person": None, "cells": {frame: cell}, "replace": False})
            if self.state["follow"]:
                self.state |= self.judged(frame)
                await self.send_frame()
            await self.broadcast(self.state)
            await asyncio.sleep(self.frame_s)
        track |= NO_TRACK | {"message": f"done: {track['done']} frames"}
        await self.broadcast(self.state)

    async def send_curves(self, frames, replace, shift=0.0):
        plots = PLOTS[self.curves_group]
        values = shift + np.stack(
            [curve(i, frames % 101 if shift else frames) for i in range(sum(len(p[2]) for p in plots))]
        )
        header = {
            "type": "curves", "group": self.curves_group, "person": 0, "replace": replace, "count": len(frames),
            "plots": [dict(zip(("title", "unit", "labels", "dofs"), plot, strict=True)) for plot in plots],
        }  # fmt: skip
        await self.send_binary(header, frames.astype("<u4").tobytes() + values.astype("<f4").tobytes())

    async def run_search(self):
        """Search until it is stopped: a test on a loaded machine may take long to press the button."""
        for step in itertools.count():
            self.state["job"] = self.idle_job("") | {
                "running": True, "kind": "frame", "stage": STAGES[min(step // 13, 2)], "evaluations": 97 * step,
            }  # fmt: skip
            self.state["cost_px"] = 0.88 + 0.59 * 0.97**step
            await self.broadcast(self.state)
            await self.send_overlay(candidate=0.05 * np.sin(step))
            await asyncio.sleep(0.04)

    async def send_all(self, socket):
        cameras = [
            {"name": CAMERA_NAMES[c % 4] + ("" if c < 4 else str(c // 4 + 1)), "width": width, "height": height}
            for c, (width, height) in enumerate(self.sizes[c % len(self.sizes)] for c in range(self.n_cameras))
        ]
        people = [
            {
                "name": f"person {p}",
                "color": COLORS[p],
                "model": "stick",
                "height_m": 1.7,
                "points": list(REST),
                "minor": ["waist"],
                "heading": [name for name in REST if name.endswith(("shoulder", "hip"))],
                "bones": BONES,
                "parts": PARTS,
                "limbs": LIMBS,
                "dofs": DOFS,
                "point_dofs": {name: [0, 1, 2, 4, 5, 6] if name == "torso" else [3] for name in REST},
                "point_limbs": {name: {"name": limb_of(name), "dofs": [3]} for name in REST},
            }
            for p in range(self.n_people)
        ]
        await socket.send_str(encoded({
            "type": "session", "name": self.name, "fps": 30.0, "n_frames": self.n_frames, "cameras": cameras,
            "people": people, "doubtful_from": 0.02, "lost_from": 0.5, "start": self.start, "role": self.role,
            "has_outlines": self.has_outlines,
            "has_place": self.role != "look" or bool(self.name_asked),
        }))  # fmt: skip
        for message in (self.state, self.settings, self.view_3d, self.body_sizes, self.presence):
            await socket.send_str(encoded(message))
        cells = {k: self.cell(k) for k in range(self.n_frames * 100 // N_FRAMES)}
        for person in (None, *(range(self.n_people) if self.n_people > 1 else ())):
            told = {"type": "timeline", "person": person, "cells": cells, "replace": True}
            await socket.send_str(encoded(told))
        await socket.send_str(encoded({"type": "inconsistent", "frames": DISAGREEING, "keyframes": []}))
        if self.views:
            await self.send_frame([socket])

    async def thumbnail(self, request):
        """Answer a request for a thumbnail, as the program does beside the socket."""
        self.thumbnails.append(request.path_qs.removeprefix("/"))
        picture = self.picture(0, int(request.match_info["frame"]), "image")
        return web.Response(body=picture, content_type="image/jpeg")

    def cell(self, frame):
        return {
            "source": self.sources[frame // 10 % len(self.sources)],
            "cost_px": 1 + 0.5 * np.sin(frame / 7) + (frame == 50) * 9,
            "keyframe": frame % 20 == 0,
            "status": "" if frame < 10 else status_of(frame),
            "remark": REMARK if frame in (31, 32) else "",
            "reviewed": frame % 20 == 0 or frame < 16,
            "ambiguous": frame in AMBIGUOUS,
            "limbs_lost": LIMBS_LOST.get(status_of(frame), []) if frame >= 10 else [],
        }

    async def tell(self, **state):
        """Change the state, and send it."""
        self.state |= state
        await self.broadcast(self.state)

    async def broadcast(self, message):
        text = encoded(message)
        for socket in list(self.sockets):
            with contextlib.suppress(ConnectionError):
                await socket.send_str(text)

    async def send_binary(self, header, payload, sockets=None):
        text = encoded(header).encode()
        for socket in list(self.sockets) if sockets is None else sockets:
            with contextlib.suppress(ConnectionError):
                await socket.send_bytes(struct.pack("<I", len(text)) + text + payload)

    async def send_frame(self, sockets=None):
        """Send the pictures of the frame and its overlay; like the program, never those of two frames at once."""
        async with self.sending:
            await self._send_frame(sockets)

    async def _send_frame(self, sockets=None):
        frame, view = self.state["frame"], self.views[-1]
        layers = [layer for layer in ("image", "silhouette", "distance", "parts") if layer in view["layers"]]
        seen = [camera for camera, reduction in enumerate(view["reductions"]) if reduction]
        wanted = [(layer, camera) for layer in layers for camera in seen]
        together = {"set": next(self.set_numbers), "of": len(wanted)}
        for layer, camera in wanted:
            await asyncio.sleep(self.image_delay_s)
            if self.held:
                await self.held.wait()
            header = self.header(camera, frame, layer) | together
            await self.send_binary(header, self.picture(camera, frame, layer), sockets)
        await self.send_overlay(sockets)

    def header(self, camera, frame, layer="image"):
        """Of a picture that is a set by itself."""
        limit_px = 38.4 if layer == "distance" else None
        return {
            "type": "image", "layer": layer, "camera": camera, "frame": frame,
            "set": next(self.set_numbers), "of": 1,
            "limit_px": limit_px,
        }  # fmt: skip

    async def send_overlay(self, sockets=None, candidate=None):
        paths, segments, handles = [], [], []

        def add(camera, person, kind, color, lines, side=""):
            paths.append({
                "camera": camera, "person": person, "kind": kind, "color": color, "side": side,
                "first": sum(map(len, segments)), "count": len(lines),
            })  # fmt: skip
            segments.append(lines)

        for camera in range(self.n_cameras):
            for person in range(self.n_people):
                add(camera, person, "model", COLORS[person], self.outline(camera, person, 0.0))
                if self.sides_line:
                    add(camera, person, "model", COLORS[person], HIDDEN_LINE - (0, 20, 0, 20), "left")
                    add(camera, person, "model", COLORS[person], HIDDEN_LINE, "right")
                if "hidden" in self.views[-1]["layers"]:
                    add(camera, person, "hidden", COLORS[person], HIDDEN_LINE)
                if "errors" in self.views[-1]["layers"] and self.state["expected_errors_m"]:
                    add(camera, person, "error", COLORS[person], self.error_circle(camera, person))
                if self.other_kind:
                    add(camera, person, self.other_kind, "#ff9df2", self.outline(camera, person, 0.2))
                if candidate is not None:
                    add(camera, person, "candidate", "#ffffff", self.outline(camera, person, candidate))
                for (p, name), at in self.pose.items():
                    if p != person:
                        continue
                    ((u, v),) = project((at + self.walked)[None], camera)
                    visible = (name.startswith("l_"), name.startswith("r_"))[camera % 2] or name in ("torso", "head")
                    handles.append({
                        "camera": camera, "person": p, "point": name, "u": u, "v": v, "visible": visible,
                        "hidden_by": None if visible or self.hider is None else self.hider,
                        "held": (p, name) in self.held_joints, "side": SIDES.get(name[:2], ""),
                    })  # fmt: skip
            if self.epipolar_of and self.epipolar_of[0] != camera:
                v = HEIGHT / 2 + 20 - SCALE * self.epipolar_of[1]
                add(camera, 0, "epipolar", "#ff5d8f", np.array([[0, v, WIDTH - 1, v]]))
        header = {
            "type": "overlay", "frame": self.state["frame"], "seq": self.seq, "job": candidate is not None,
            "paths": paths, "outlines": [], "handles": handles, "heads": [], "pins": [], "triangulation": None,
            "out_of_reach": self.out_of_reach,
        }  # fmt: skip
        await self.send_binary(header, np.concatenate(segments).astype("<f4").tobytes(), sockets)

    def error_circle(self, camera, person):
        """A circle of 40 px around the head as line segments, (N, 4) px."""
        around = np.linspace(0, 2 * np.pi, 33)
        (center,) = project((self.pose[person, "head"] + self.walked)[None], camera)
        ring = center + 40 * np.stack([np.cos(around), np.sin(around)], axis=1)
        return np.concatenate([ring[:-1], ring[1:]], axis=1)

    def outline(self, camera, person, shift):
        """A capsule round each bone as line segments, (N, 4) px."""
        around = np.linspace(0, 2 * np.pi, 33)
        lines = []
        for names in BONES:
            ends = project(np.stack([self.pose[person, n] for n in names]) + self.walked + shift, camera)
            axis = ends[1] - ends[0]
            length = np.hypot(*axis) + 1e-9
            along, across = axis / length, np.array([-axis[1], axis[0]]) / length
            ring = (
                ends.mean(axis=0)
                + np.outer(np.cos(around), along * (length / 2 + 8))
                + np.outer(np.sin(around), across * 14)
            )
            lines.append(np.concatenate([ring[:-1], ring[1:]], axis=1))
        return np.concatenate(lines)

    @property
    def walked(self):
        """Way of the people from frame 12, where the page opens, to the shown one."""
        return np.array([self.walk_m * (self.state["frame"] - 12), 0.0, 0.0])

    def picture(self, camera, frame, layer):
        """The image of a room with a bright figure that shows its number; masks and a distance image of even colour."""
        return jpeg(self.sizes[camera % len(self.sizes)], camera, frame if layer == "image" else 0, layer)


@functools.lru_cache(maxsize=2000)
def jpeg(size, camera, frame, layer):
    """A picture as JPEG."""
    color = {"silhouette": (140, 224, 74), "distance": (164, 255, 252), "parts": (30, 30, 250)}.get(layer)
    image = room(camera, frame) if color is None else np.full((HEIGHT, WIDTH, 3), color, np.uint8)
    return cv2.imencode(".jpg", cv2.resize(image, size))[1].tobytes()


def room(camera, frame):
    """A room with a bright figure, (HEIGHT, WIDTH, 3)."""
    rows = np.linspace(90, 50, HEIGHT)[:, None, None] * np.array([1.0, 0.95, 0.9])
    image = np.broadcast_to(rows, (HEIGHT, WIDTH, 3)).astype(np.uint8).copy()
    cv2.rectangle(image, (0, 380), (WIDTH, HEIGHT), (70, 78, 84), -1)
    for x in range(-40, WIDTH, 90):
        cv2.rectangle(image, (x + 9 * camera, 60), (x + 50 + 9 * camera, 250), (96, 88, 82), 3)
    for names in BONES:
        ends = project(np.array([REST[n] for n in names]), camera).round().astype(int)
        cv2.line(image, ends[0], ends[1], (150, 160, 190), 24, cv2.LINE_AA)
    cv2.putText(image, str(frame), (280, 460), cv2.FONT_HERSHEY_SIMPLEX, 1.0, (200, 200, 200), 2, cv2.LINE_AA)
    return image


async def main(port):
    from app.server.access import access_for
    from app.server.address import listen
    from app.server.private_viser import PrivateViser
    from app.server.server import create_app, serve_forever
    from app.server.static_files import static_folder

    scene = PrivateViser()
    access = access_for("127.0.0.1", token=False)
    app: web.Application = create_app(FakeEndpoint(n_people=1), scene.place, access, static_folder())
    await serve_forever(app, listen("127.0.0.1", port), lambda: print(f"http://127.0.0.1:{port}/"))


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1]) if len(sys.argv) > 1 else 8080))
