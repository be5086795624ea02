"""Bring the documents of the repository's root into the site, and keep the links between both."""

import posixpath
import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

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


def anchor(heading: str, separator: str) -> str:
    """Return the anchor of a heading as forges make it, on which the links of the documents rely."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", separator)


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Use the forge's anchors."""
    config.mdx_configs["toc"] = {"slugify": anchor, "permalink": True}
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the documents of the root."""
    for source, place in OUTSIDE.items():
        files.append(File.generated(config, place, abs_src_path=str(ROOT / source)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let each link between `docs` and the root lead to the place in the site."""
    sources = {place: source for source, place in OUTSIDE.items()}
    source = Path(sources.get(page.file.src_uri) or Path("docs") / page.file.src_uri)

    def led(link: re.Match[str]) -> str:
        path = (ROOT / source.parent / link[1]).resolve().relative_to(ROOT)
        place = OUTSIDE.get(path.as_posix()) or path.as_posix().removeprefix("docs/")
        return f"]({posixpath.relpath(place, posixpath.dirname(page.file.src_uri))}"

    return LINK.sub(led, markdown)
