"""Which Chromium the tests drive; run as a program (`make test` does), install one where there is none."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = [
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-gpu-compositing",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
]


def chromium_path():
    """The browser that the environment names, else the system's; None means Playwright's own, there or not."""
    named = os.environ.get("QUADRILLE_CHROMIUM")
    if named:
        return named
    return next(filter(None, map(shutil.which, NAMES)), None)


def install():
    """Install Chromium by the system's packages where that is allowed, else Playwright's own."""
    root = [] if os.geteuid() == 0 else ["sudo", "-n"]
    if shutil.which("apt-get") and (not root or shutil.which("sudo")):
        commands = ([*root, "apt-get", *arguments] for arguments in (["update"], ["install", "-y", "chromium"]))
        if all(subprocess.run(command, check=False).returncode == 0 for command in commands):
            return
    subprocess.run([sys.executable, "-m", "playwright", "install", "chromium"], check=True)


def main():
    if chromium_path():
        return
    with sync_playwright() as playwright:
        has_own = Path(playwright.chromium.executable_path).exists()
    if not has_own:
        install()


if __name__ == "__main__":
    main()
