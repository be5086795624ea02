"""Folders that the system refuses to list."""

import os


def refuse_folders(monkeypatch, ending, error=None):
    """Refuse to list the folders whose paths end so, by a missing permission or another error."""
    real = os.scandir

    def scandir(path):
        if str(path).endswith(ending):
            raise error or PermissionError(13, "Permission denied", str(path))
        return real(path)

    monkeypatch.setattr(os, "scandir", scandir)
