"""Read poses as arrays, and draw the height of a joint over time with its error as a picture."""

import sys

import cv2
import numpy as np

import quadrille

WIDTH, HEIGHT = 800, 300


def main(folder: str, joint: str, out: str) -> None:
    """Draw the height of a joint over the frames of a session of one person."""
    poses = quadrille.read_poses(folder)
    height_m, error_m = poses.joint(joint)[:, 2], np.nan_to_num(poses.errors_m(joint))
    low, high = (height_m - error_m).min(), (height_m + error_m).max() + 1e-6
    x = np.interp(poses.times_s, [poses.times_s[0], poses.times_s[-1] + 1e-6], [20, WIDTH - 20])
    picture = np.full((HEIGHT, WIDTH, 3), 255, np.uint8)
    for offset, color in ((-error_m, (200, 200, 200)), (error_m, (200, 200, 200)), (0, (180, 90, 20))):
        y = np.interp(height_m + offset, [low, high], [HEIGHT - 20, 20])
        cv2.polylines(picture, [np.column_stack([x, y]).astype(np.int32)], False, color, 2, cv2.LINE_AA)
    cv2.imwrite(out, picture)
    print(f"{joint}: {len(poses)} frames, {low:.2f} to {high:.2f} m")


if __name__ == "__main__":
    main(*sys.argv[1:])
