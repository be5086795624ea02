"""A program that answers what the forms of a new session and of a calibration ask for."""

import asyncio
import base64
import json
from urllib.parse import parse_qs, urlparse

LISTED = {"refusal": None, "folder": "/data/here", "recent": [], "batches": []}
STARTED = {"steps": [], "at": 0, "folder": "/data/new"}
NAMES = ("FRONT", "RIGHT", "BACK", "LEFT")
FOLDERS = {
    "/data": [("videos", "folder"), ("walk", "session"), ("cameras.toml", "file"), ("notes.txt", "file")],
    "/data/videos": [*((f"{name}.mp4", "video") for name in NAMES), ("gopro7.mp4", "video")],
}
DOUBT = "The upper sides of the pictures point along y, not z: check which axis points up."
RIG = {
    "names": list(NAMES), "centers": [[3, 3, 2], [-3, 3, 2], [-3, -3, 2.5], [3, -3, 2]],
    "axes": [[-0.7, -0.7, -0.2], [0.7, -0.7, -0.2], [0.7, 0.7, -0.3], [-0.7, 0.7, -0.2]], "point": [0, 0, 1],
    "distances_m": [4.36, 4.36, 4.5, 4.36], "heights_m": [2, 2, 2.5, 2],
    "sentence": "The cameras stand 4.36 to 4.50 m from the point at which they look.", "doubts": [DOUBT],
}  # fmt: skip
FOOTAGE = [{"path": f"/data/videos/{n}.mp4", "name": f"{n}.mp4"} for n in (*NAMES, "gopro7")]
SURVEY = {
    "cameras": list(NAMES), "footage": FOOTAGE, "assigned": {n: f"/data/videos/{n}.mp4" for n in NAMES[:3]},
    "rig": RIG, "beside": {}, "problems": [],
}  # fmt: skip
PASSED = {"passed": "The calibration has 4 cameras."}
EXCHANGED = {
    "exchanged": {"cameras": ["FRONT", "BACK"], "with_backgrounds": True, "text": "these seem to be exchanged"}
}
PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)


class Program:
    """Answers what the form asks for."""

    def __init__(self):
        self.posted, self.surveyed, self.previews = [], [], set()
        self.outcomes = [[PASSED, EXCHANGED], [PASSED, {"made": "/data/new"}]]
        self.survey, self.calibrated = SURVEY, [{"failed": "no view shows the board"}]
        self.may_answer = asyncio.Event()
        self.may_answer.set()

    async def answer(self, route):
        url = urlparse(route.request.url)
        what, query = url.path.partition("/sessions")[2], parse_qs(url.query)
        if what == "/folder":
            folder = query.get("path", ["/data"])[0].rstrip("/")
            folder = folder.rpartition("/")[0] if "." in folder else folder  # that of a file
            if folder not in FOLDERS:
                await route.fulfill(status=400, body=f"expected a folder that can be read, found {folder}")
                return
            entries = [{"name": n, "path": f"{folder}/{n}", "kind": kind} for n, kind in FOLDERS[folder]]
            parent = "/data" if folder != "/data" else None
            await route.fulfill(json={"folder": folder, "parent": parent, "entries": entries, "is_cut_off": False})
        elif what == "/preview":
            self.previews.add(query["path"][0])
            await route.fulfill(body=PIXEL, content_type="image/png")
        elif what == "/models":
            await route.fulfill(
                json={"models": ["gavrila22", "gavrila34"], "default": "gavrila34", "dictionaries": ["DICT_4X4_50"]}
            )
        elif what == "/survey":
            self.surveyed.append(json.loads(route.request.post_data))
            await route.fulfill(json=self.survey)
        elif what == "/new":
            self.posted.append(json.loads(route.request.post_data))
            await route.fulfill(body="\n".join(map(json.dumps, self.outcomes[len(self.posted) - 1])))
        elif what == "/open":
            self.posted.append(json.loads(route.request.post_data))
            await route.fulfill(json={"name": "new"})
        elif what == "/calibrate":
            self.posted.append(json.loads(route.request.post_data))
            await self.may_answer.wait()
            await route.fulfill(body="\n".join(map(json.dumps, self.calibrated)))
        else:
            await route.fulfill(json=[] if what == "/paths" else LISTED)
