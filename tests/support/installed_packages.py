"""Packages as pip installs them, with one module and the entry points that name it."""


def install(folder, name, code, points):
    """Install a package with a module below a folder of Python's path; the entry points are text or bytes."""
    (folder / f"{name}.py").write_text(code)
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Name: {name}\nVersion: 1.0\n")
    (info / "entry_points.txt").write_bytes(points if isinstance(points, bytes) else points.encode())
