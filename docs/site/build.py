"""Build the documents as a site: `python docs/site/build.py OUT`, or `make docs`. OUT is replaced.

Documents of the repository's root are brought in, and links between both keep leading to their places. mkdocs.yml is
the configuration, which Zensical reads.
"""

import argparse
import posixpath
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
OUTSIDE = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "CONTRIBUTING.md",
    "CHANGELOG.md": "CHANGELOG.md",
    "SECURITY.md": "SECURITY.md",
    "sample_sessions/README.md": "sample_sessions.md",
}
"""Documents outside of `docs`, and their places in the site."""
LINK = re.compile(r"\]\((?!https?:)([^)#\s]+)")


def with_site_links(text: str, source: str, place: str) -> str:
    """Return a document whose links between `docs` and the root lead to places in the site.

    Args:
        text: the document.
        source: its path in the repository.
        place: its path in the site's sources.
    """

    def led(link: re.Match[str]) -> str:
        path = (ROOT / source).parent.joinpath(link[1]).resolve().relative_to(ROOT).as_posix()
        return f"]({posixpath.relpath(OUTSIDE.get(path) or path.removeprefix('docs/'), posixpath.dirname(place))}"

    return LINK.sub(led, text)


def build(out: Path) -> None:
    """Build the site; a warning is an error."""
    with tempfile.TemporaryDirectory() as temporary:
        is_left_out = shutil.ignore_patterns("site", "examples")
        docs = shutil.copytree(ROOT / "docs", Path(temporary) / "docs", ignore=is_left_out)
        sources = {f"docs/{p.relative_to(docs).as_posix()}": p.relative_to(docs).as_posix() for p in docs.rglob("*.md")}
        for source, place in (sources | OUTSIDE).items():
            text = (ROOT / source).read_text("utf-8")
            (docs / place).write_text(with_site_links(text, source, place), "utf-8")
        settings = (ROOT / "mkdocs.yml").read_text("utf-8")
        (Path(temporary) / "mkdocs.yml").write_text(settings.replace("paths: [.]", f"paths: ['{ROOT}']"), "utf-8")
        subprocess.run([sys.executable, "-m", "zensical", "build", "--clean", "--strict"], cwd=temporary, check=True)
        shutil.rmtree(out, ignore_errors=True)
        shutil.copytree(Path(temporary) / "site", out)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    build(parser.parse_args().out)
