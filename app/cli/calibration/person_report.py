"""The report of `quadrille calibrate --people`."""

from typing import TYPE_CHECKING, Any

import numpy as np

from app.session.calibration_record import shared_record

if TYPE_CHECKING:
    from tracker.calibration.self_calibration.person_calibration import PersonCalibration


def record_of(found: "PersonCalibration") -> dict[str, Any]:
    """Return the result as plain data; docs/log/calibration.md lists its keys."""
    adjusted = found.adjusted
    joints = found.world.joints_world[np.isfinite(found.world.joints_world).all(axis=-1)]
    people, seen = found.identified, found.seen
    cameras = [{"joints": int(n)} for n in seen.is_seen.sum(axis=(0, 2))]
    by_person = seen.is_seen.reshape(*seen.is_seen.shape[:2], seen.n_people, -1)
    shared = (by_person.any(axis=3).sum(axis=1) > 1).sum(axis=0)
    return {
        "people": [{"name": name, "frames": int(n)} for name, n in zip(people.names, shared, strict=True)],
        "pictures_left_out": people.n_left_out,
        "exchanged": people.n_exchanged,
        "frames": len(seen.px),
        "joints": len(joints),
        "points": found.points,
        "noise_px": adjusted.sigma_px,
        "held_out_frames": len(found.held_out.frames),
        "scale_sigma_percent": 100 * found.scale_sigma,
        "notes": list(found.notes),
        **shared_record(cameras, adjusted.fit, found.held_out, found.volume, joints),
    }


def format_record(record: dict[str, Any]) -> str:
    """Return the same for people."""
    n_people = len(record["people"])
    whose = "a person" if n_people == 1 else f"{n_people} people"
    lines = [
        f"wrote {record['out']}: {len(record['cameras'])} cameras from {record['joints']} {record['points']} of "
        f"{whose} in {record['frames']} frames"
    ]
    if n_people > 1:
        lines.append(f"  people: {', '.join('{name} in {frames} frames'.format(**p) for p in record['people'])}")
    width = max(len(c["name"]) for c in record["cameras"])
    for c in record["cameras"]:
        sigma = f" +- {c['focal_sigma_percent']:.1f}%" if c["focal_sigma_percent"] else ", as given"
        off = "  nothing held out" if c["held_out_px"] != c["held_out_px"] else f"{c['held_out_px']:6.2f} px held out"
        lines.append(
            f"  {c['name']:{width}}  {c['joints']:5} {record['points']}, focal length {c['focal_px'][0]:7.1f} px"
            f"{sigma}, {off}"
        )
    size, (low, high) = " x ".join(f"{side:.1f}" for side in record["volume_m"]), record["interval_mm"]
    lines.append(
        f"expected error in the volume of {whose} ({size} m), without that of the scale and of the detector: "
        f"{record['expected_error_mm']:.1f} mm, with 90% between {low:.1f} and {high:.1f} mm"
    )
    lines += [f"note: {note}" for note in record["notes"]]
    lines.append(f"the world has z up and its origin on the floor below {'the person' if n_people == 1 else 'them'}")
    return "\n".join(lines)
