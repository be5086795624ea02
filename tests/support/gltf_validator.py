"""The Khronos validator of glTF, by the Node of the project."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
VALIDATOR = ROOT / "node_modules" / "gltf-validator"
VALIDATE = """
const validator = require(process.argv[1]);
const bytes = new Uint8Array(require("fs").readFileSync(process.argv[2]));
validator.validateBytes(bytes).then((report) => console.log(JSON.stringify(report.issues)));
"""


def check_gltf(path):
    """Fail if a file has errors or warnings; skip without the validator."""
    if not VALIDATOR.is_dir():
        message = "the glTF validator is not installed: npm install"
        pytest.fail(message) if os.environ.get("CI") == "true" else pytest.skip(message)
    node = Path(sys.executable).parent / "node"
    done = subprocess.run([node, "-e", VALIDATE, VALIDATOR, path], capture_output=True, text=True, check=True)
    issues = json.loads(done.stdout)
    assert issues["numErrors"] == 0, issues["messages"]
    assert issues["numWarnings"] == 0, issues["messages"]
