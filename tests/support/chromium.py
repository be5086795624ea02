"""Which Chromium the tests drive; run as a program (`make test` does), install one where there is none."""

import os
import shutil
import subprocess
import sys

SHELL = "chromium-headless-shell"
"""Chromium without windows: a third less processor time."""
NAMES = (SHELL, "chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
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
        for arguments in (["update"], ["install", "-y", SHELL], ["install", "-y", "chromium"]):
            done = subprocess.run([*root, "apt-get", *arguments], check=False)
            if done.returncode == 0 and arguments[0] == "install":
                return
    subprocess.run([sys.executable, "-m", "playwright", "install", "--only-shell", "chromium"], check=True)


if __name__ == "__main__" and not chromium_path():
    install()
