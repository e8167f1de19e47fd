#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""assembly_analysis.py PROGRAM SAMPLES PAGE: makes the mesh of docs/tasks/assemblies.md, solves the model of that page
with CalculiX, and compares the displacement of the interface of cork and block with what is known.

Exit status 0 if they agree, 1 if not, 77 if there is no CalculiX.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

DENSITY, ACCELERATION, HEIGHT, MODULUS = 7.8e-9, 1e6, 20, 30  # of the block, and of the cork, both as high
DISPLACEMENT = DENSITY * ACCELERATION * HEIGHT * HEIGHT / MODULUS


def model_of(page):
    """The model of the page: the block that begins with *INCLUDE."""
    return re.search(r"```text\n(\*INCLUDE.*?)```", page, re.S).group(1)


def displacements(dat):
    """The displacements along z of the nodes in a .dat file."""
    rows = [line.split() for line in dat.splitlines() if re.match(r"\s+\d+\s+-?\d\.\d+E", line)]
    return [float(row[3]) for row in rows]


def main():
    program, samples, page = (Path(path).resolve() for path in sys.argv[1:4])
    if not shutil.which("ccx"):
        print("SKIPPED: needs CalculiX (calculix-ccx)")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        def run(*words):
            subprocess.run([str(word) for word in words], cwd=folder, check=True, stdout=subprocess.PIPE,
                           env=dict(os.environ, OMP_NUM_THREADS="1"))

        run(samples, ".")
        run(program, "fit", "mount.stl", "-o", "mount.inp", "--quiet")
        (Path(folder) / "model.inp").write_text(model_of(page.read_text()))
        run("ccx", "model")
        found = displacements((Path(folder) / "model.dat").read_text())
    print(f"{len(found)} nodes move by {min(found):.6f} to {max(found):.6f}, known {DISPLACEMENT:.6f}")
    return 0 if len(found) > 3 and all(abs(one / DISPLACEMENT - 1) < 1e-3 for one in found) else 1


sys.exit(main())
