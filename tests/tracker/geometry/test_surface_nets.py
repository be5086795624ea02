import numpy as np
import trimesh

from tracker.geometry.surface_nets import surface_nets


def test_meshes_an_ellipsoid_closed_outward_and_in_place():
    axes = [np.arange(n) * 0.1 - 1.6 for n in (33, 30, 37)]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    field = (np.sqrt((x / 1.2) ** 2 + y**2 + (z - 0.2) ** 2) - 1.0).astype(np.float32)
    vertices, faces = surface_nets(field, np.full(3, -1.6), 0.1)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    # Counter-clockwise from outside: the volume has a positive sign.
    assert np.isclose(mesh.volume, 4 / 3 * np.pi * 1.2, rtol=0.02)
    radii = np.linalg.norm((vertices - (0, 0, 0.2)) / (1.2, 1, 1), axis=1)
    assert np.abs(radii - 1.0).max() < 0.01
