# SPDX-License-Identifier: GPL-3.0-or-later
"""Build backend of pip (PEP 517): a wheel of the Python module that CMake builds and installs."""

import base64
import glob
import hashlib
import os
import subprocess
import sys
import sysconfig
import tempfile
import zipfile

SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Builds the module and returns the wheel's name. config_settings: {"cmake": "-DNAME=VALUE ..."} is passed on."""
    options = [*viewer_options(), *(config_settings or {}).get("cmake", "").split()]
    with tempfile.TemporaryDirectory() as folder:
        build, stage = os.path.join(folder, "build"), os.path.join(folder, "stage")
        run("cmake", "-S", SOURCE, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DSUBVOL_BUILD_PYTHON=ON",
            "-DSUBVOL_BUILD_CLI=OFF", "-DSUBVOL_BUILD_TESTS=OFF", "-DSUBVOL_BUILD_SAMPLES=OFF", "-DSUBVOL_UNITY=ON",
            "-DSUBVOL_PYTHON_DIR=.", f"-DPython_EXECUTABLE={sys.executable}", *options)
        run("cmake", "--build", build, "--target", "subvol_python")
        run("cmake", "--install", build, "--component", "python", "--prefix", stage, "--strip")
        return write_wheel(stage, wheel_directory)


def viewer_options():
    """The npm packages that cmake/install_viewer has put into a build folder of the sources, if it has."""
    for folder in sorted(glob.glob(os.path.join(SOURCE, "build", "*", "node", "node_modules"))):
        return [f"-DSUBVOL_NODE_MODULES={folder}"]
    return []


def run(*command):
    subprocess.run(command, check=True)


def write_wheel(stage, wheel_directory):
    """Writes the installed files as a wheel. Its record is made anew, with the hash of each file."""
    info = next(name for name in os.listdir(stage) if name.endswith(".dist-info"))
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    tag = f"{python}-{python}-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"
    name = f"{info[:-len('.dist-info')]}-{tag}.whl"
    with open(os.path.join(stage, info, "WHEEL"), "w") as file:
        file.write(f"Wheel-Version: 1.0\nGenerator: subvol\nRoot-Is-Purelib: false\nTag: {tag}\n")
    record = os.path.join(info, "RECORD")
    lines = []
    with zipfile.ZipFile(os.path.join(wheel_directory, name), "w", zipfile.ZIP_DEFLATED) as wheel:
        for path in sorted(files_in(stage)):
            if path in (record, os.path.join(info, "INSTALLER")):
                continue
            with open(os.path.join(stage, path), "rb") as file:
                content = file.read()
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            lines.append(f"{path},sha256={digest},{len(content)}")
            wheel.writestr(path, content)
        wheel.writestr(record, "\n".join([*lines, f"{record},,"]) + "\n")
    return name


def files_in(folder):
    for root, _, names in os.walk(folder):
        for name in names:
            yield os.path.relpath(os.path.join(root, name), folder)
