# SPDX-License-Identifier: GPL-3.0-or-later
"""install_wheel.py PACKAGES SOURCE: packs the module that is installed in the folder PACKAGES as a wheel, as `pip wheel`
does after its build, installs the wheel with pip and without a registry, and imports it. Exit status 77 without pip."""

import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile

if importlib.util.find_spec("pip") is None:
    print("SKIPPED: no pip; apt-get install python3-pip")
    sys.exit(77)
packages, source = sys.argv[1:]
sys.path.insert(0, os.path.join(source, "python", "packaging"))
import wheel_backend  # noqa: E402

with tempfile.TemporaryDirectory() as folder:
    stage, target = os.path.join(folder, "stage"), os.path.join(folder, "target")
    os.mkdir(stage)
    for name in os.listdir(packages):
        if name == "subvol" or name.startswith("subvol-"):
            shutil.copytree(os.path.join(packages, name), os.path.join(stage, name))
    wheel = os.path.join(folder, wheel_backend.write_wheel(stage, folder))
    pip = [sys.executable, "-m", "pip", "install", "--no-index", "--no-deps", "--quiet", "--no-warn-script-location"]
    subprocess.run([*pip, "--target", target, wheel], check=True)
    code = ("import importlib.metadata, subvol; "
            "assert importlib.metadata.version('subvol') == subvol.__version__; print(subvol.__file__)")
    said = subprocess.run([sys.executable, "-B", "-c", code], check=True, cwd=folder, stdout=subprocess.PIPE, text=True,
                          env={**os.environ, "PYTHONPATH": target}).stdout
    if not said.startswith(target):
        sys.exit(f"another module was imported: {said}")
