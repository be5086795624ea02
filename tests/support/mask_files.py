"""Masks as other programs write them: PNG of several modes, and COCO with segmentations."""

import json

import numpy as np
from PIL import Image

SIZE = (80, 60)
"""Of small pictures, which are read quickly."""


def person_masks(n_frames, n_views, size=SIZE, people=1):
    """Blocks of people that walk, (n_frames, n_views, H, W): k person k."""
    out = np.zeros((n_frames, n_views, *size[::-1]), np.uint8)
    for k, v, p in np.ndindex(n_frames, n_views, people):
        left = (4 + k + 3 * v + 18 * p) * size[0] // SIZE[0]
        out[k, v, size[1] // 4 : size[1] * 3 // 4, left : left + size[0] // 8] = p + 1
    return out


def image_of(mask, mode="L"):
    """A mask of values up to 255 as an image of Pillow's mode; `cut out` is a colour picture with opacity."""
    if mode == "cut out":
        colors = np.random.default_rng(0).integers(0, 255, (*mask.shape, 3), np.uint8)
        return Image.fromarray(np.dstack([colors, np.where(mask > 0, 255, 0).astype(np.uint8)]))
    if mode == "P":
        image = Image.fromarray(mask, "P")
        image.putpalette([0, 0, 0, *np.random.default_rng(1).integers(0, 255, 3 * 255).tolist()])
        return image
    if mode == "I;16":
        return Image.fromarray(mask.astype(np.uint16) * 257)
    if mode == "1":
        return Image.fromarray(mask > 0)
    return Image.fromarray(mask).convert(mode)


def write_masks(folder, names, masks, name="{camera}_{k:06d}.png", mode="L"):
    """A folder for each camera, a picture for each frame."""
    for v, camera in enumerate(names):
        (folder / camera).mkdir(parents=True)
        for k, mask in enumerate(masks[:, v]):
            image_of(mask, mode).save(folder / camera / name.format(camera=camera, k=k))
    return folder


def segmentation_of(mask, of):
    """A block as `polygon`, or any mask as `runs` or `text`, which pycocotools writes."""
    if of == "polygon":
        rows, columns = np.nonzero(mask)
        x, y, right, bottom = (float(c) for c in (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1))
        return [[x, y, right, y, right, bottom, x, bottom]]
    if of == "text":
        from pycocotools import mask as coco_mask

        found = coco_mask.encode(np.asfortranarray(mask, np.uint8))
        return {"size": found["size"], "counts": found["counts"].decode()}
    flat = mask.ravel(order="F").astype(bool)
    ends = np.flatnonzero(np.diff(flat, prepend=False))
    return {"size": list(mask.shape), "counts": np.diff(ends, prepend=0, append=flat.size).tolist()}


def coco_data(names, masks, of="polygon", **more):
    """A dataset of all cameras, whose images lie in folders of cameras; `more` is in each annotation."""
    images, annotations = [], []
    for v, camera in enumerate(names):
        for k, mask in enumerate(masks[:, v]):
            size = {"width": mask.shape[1], "height": mask.shape[0]}
            images.append({"id": len(images) + 1, "file_name": f"{camera}/{k:06d}.jpg", **size})
            for value in np.unique(mask[mask > 0]).tolist():
                found = segmentation_of(mask == value, of)
                annotations.append(
                    {"id": len(annotations), "image_id": len(images), "category_id": 1, "segmentation": found, **more}
                )
    return {"images": images, "annotations": annotations, "categories": [{"id": 1, "name": "person"}]}


def write_coco_masks(path, names, masks, of="polygon", **more):
    path.write_text(json.dumps(coco_data(names, masks, of, **more)))
    return path
