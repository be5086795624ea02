"""Write a judgement of imported observations as one HTML file, with pictures of the worst frames."""

import base64
import html
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from app.export.report_files import write_html
from tracker.evaluation.judging.judge import Doubt, Judgement
from tracker.evaluation.judging.verdicts import LIMBS
from tracker.footage.recording import Recording
from tracker.geometry.arrays import Array, Image
from tracker.geometry.cameras import Camera
from tracker.interchange.exports.faces import BlurredRecording
from tracker.session.session import Session

_SHOWN = 12
"""Number of entries with pictures."""
_APART = 5
"""Frames within which entries of one limb are shown as one."""
_HEIGHT_PX, _MARGIN, _QUALITY = 300, 0.25, 80
_TRUNK = ("left_shoulder", "right_shoulder", "right_hip", "left_hip", "left_shoulder")
_IMPORTED, _OFF, _TRACKED = (255, 165, 0), (230, 30, 30), (60, 150, 255)
"""Colours of imported joints, of a limb of them that is off, and of tracked joints, RGB."""
_STYLE = """
figure { margin: 1.5rem 0; } figure img { height: 300px; margin-right: 4px; border-radius: 3px; }
.imported { color: #c77700; } .off { color: #d22; } .tracked { color: #2a7de1; }
"""


def write_report(session: Session, name: str, found: Sequence[Judgement], path: Path, blur_faces: bool = False) -> None:
    """Write the report of some judgements.

    Args:
        session: the session.
        name: of the observations.
        found: the judgements, one for each person.
        path: the file; it appears complete or not at all.
        blur_faces: whether to blur the heads of all people who are known.
    """
    body = [f"<h1>{html.escape(name)}, judged by the footage of {html.escape(session.name)}</h1>"]
    body.append(
        '<p><span class="imported">Imported joints</span>, <span class="off">limbs that are off</span>, '
        '<span class="tracked">joints by contours and colours</span>.</p>'
    )
    footage = BlurredRecording(session) if blur_faces else Recording(session.cameras)
    with footage as recording:
        for own in found:
            body += _person(own, recording, [c.camera for c in session.cameras])
    write_html(path, name, body, _STYLE)


def shown_doubts(worst: Sequence[Doubt]) -> list[Doubt]:
    """Return the entries with pictures: of doubts of one limb on frames close together the worst."""
    out = list[Doubt]()
    for doubt in worst:
        if not doubt.verdict.is_doubted or len(out) == _SHOWN:
            break
        if not any(o.limb == doubt.limb and abs(o.frame - doubt.frame) <= _APART for o in out):
            out.append(doubt)
    return out


def _person(own: Judgement, recording: Recording, cameras: Sequence[Camera]) -> list[str]:
    doubted = [d for d in own.worst if d.verdict.is_doubted]
    out = [f"<h2>{html.escape(own.person)}</h2>"]
    percent = f"{100 * own.share_in_order:.0f}%"
    out.append(f"<p>{percent} of {len(own.frames)} frames are in order; {len(doubted)} limbs are off.</p>")
    out += [f"<p>{html.escape(sentence)}.</p>" for sentence in own.sentences]
    out.append("<h3>Joints</h3><table><tr><th>joint<th>constant offset<th>varying part, median</tr>")
    for joint in (j for joints in LIMBS.values() for j in joints if j in own.offsets_m):
        offset, spread = 1000 * float(np.linalg.norm(own.offsets_m[joint])), 1000 * own.spread_m[joint]
        cells = "".join(f'<td class="number">{mm:.0f} mm' for mm in (offset, spread))
        out.append(f"<tr><td>{joint.replace('_', ' ')}{cells}</tr>")
    out.append("</table><h3>Worst</h3>")
    for doubt in shown_doubts(doubted):
        pictures = "".join(_picture(image) for image in _views(own, doubt, recording, cameras))
        percent = f"{100 * doubt.verdict.probability_off:.0f}%"
        said = f"Frame {doubt.frame}: {html.escape(doubt.verdict.reason)}, {percent}"
        out.append(f"<figure><figcaption>{said}</figcaption>{pictures}</figure>")
    return out


def _picture(image: Image) -> str:
    _, data = cv2.imencode(".jpg", image[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    return f'<img alt="" src="data:image/jpeg;base64,{base64.b64encode(data.tobytes()).decode()}">'


def _views(own: Judgement, doubt: Doubt, recording: Recording, cameras: Sequence[Camera]) -> list[Image]:
    """Return the person in each view of a frame, cropped, with imported and tracked joints."""
    pose = own.tracked[doubt.frame]
    tracked = dict(zip(pose.body.model.point_names, pose.body.joint_centers_world, strict=True))
    out = []
    for camera, image in zip(cameras, recording.read(doubt.frame), strict=True):
        if image is None:
            continue
        canvas = np.array(image)
        drawn = [_draw(canvas, camera, tracked, joints, _TRACKED) for joints in (*LIMBS.values(), _TRUNK)]
        imported = own.imported.places(doubt.frame)
        for limb, joints in (*LIMBS.items(), ("", _TRUNK)):
            drawn.append(_draw(canvas, camera, imported, joints, _OFF if limb == doubt.limb else _IMPORTED))
        px = np.concatenate(drawn)
        if len(px):
            out.append(_cropped(canvas, px))
    return out


def _draw(
    canvas: Image, camera: Camera, places: dict[str, Array], joints: Sequence[str], color: tuple[int, ...]
) -> Array:
    """Draw the bones between joints, and return the joints that are in the picture, (N, 2), px."""
    px = [camera.project(places[j][None])[0] if j in places else np.full(2, np.nan) for j in joints]
    size = (camera.width, camera.height)
    inside = [bool(np.isfinite(p).all() and (p > -50).all() and (p < np.add(size, 50)).all()) for p in px]
    width = max(1, round(max(size) / 400))
    for i in range(len(px) - 1):
        if inside[i] and inside[i + 1]:
            ends = [tuple(np.round(px[k]).astype(int).tolist()) for k in (i, i + 1)]
            cv2.line(canvas, ends[0], ends[1], color, width, cv2.LINE_AA)
    return np.array([p for p, ok in zip(px, inside, strict=True) if ok]).reshape(-1, 2)


def _cropped(canvas: Image, px: Array) -> Image:
    """Return the part of a picture around points, at the height of the report."""
    low, high = px.min(axis=0), px.max(axis=0)
    margin = _MARGIN * float((high - low).max())
    size = np.array(canvas.shape[1::-1])
    u0, v0 = np.clip(low - margin, 0, size - 1).astype(int)  # joints may lie beside the picture
    u1, v1 = np.minimum(high + margin, size).astype(int)
    part = canvas[v0 : max(v1, v0 + 1), u0 : max(u1, u0 + 1)]
    scale = _HEIGHT_PX / part.shape[0]
    return np.asarray(cv2.resize(part, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), dtype=np.uint8)
