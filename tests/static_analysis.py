#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""static_analysis.py PROGRAM SAMPLES PAGE: makes the meshes of docs/tasks/static-analysis.md, solves the model of that
page with CalculiX, and compares the largest stress and the reaction with what is known.

Exit status 0 if they agree, 1 if not, 77 if there is no CalculiX.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

LOAD, AREA = 100, 0.02          # pressure, area of the loaded face
SHARE = 0.5 / 2                 # diameter of the hole / width of the plate
STRESS = LOAD * (3 - 3.14 * SHARE + 3.667 * SHARE**2 - 1.527 * SHARE**3) / (1 - SHARE)


def model_of(page):
    """The model of the page: the block that begins with *INCLUDE."""
    return re.search(r"```text\n(\*INCLUDE.*?)```", page, re.S).group(1)


def largest_stress(frd):
    """The largest stress along x in the nodes of an .frd file."""
    largest, within = 0, False
    for line in frd.splitlines():
        if line.startswith(" -4"):
            within = line.split()[1] == "STRESS"
        elif within and line.startswith(" -1"):
            largest = max(largest, float(line[13:25]))
    return largest


def reaction(dat):
    """The first number of the only line of totals."""
    numbers = [line.split() for line in dat.splitlines() if re.match(r"\s+-?\d\.\d+E", line)]
    return float(numbers[-1][0])


def main():
    program, samples, page = (Path(path).resolve() for path in sys.argv[1:4])
    if not shutil.which("ccx"):
        print("SKIPPED: needs CalculiX (calculix-ccx)")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        run = lambda *words: subprocess.run([str(word) for word in words], cwd=folder, check=True, stdout=subprocess.PIPE,
                                            env=dict(os.environ, OMP_NUM_THREADS="1"))
        run(samples, ".")
        run(program, "fit", "plate.obj", "-o", "plate.mesh", "--quiet")
        run(program, "optimize", "plate.mesh", "--target", "plate.obj", "--order", 2, "--map-tolerance", 0.5,
            "-o", "plate2.inp", "--quiet")
        (Path(folder) / "model.inp").write_text(model_of(page.read_text()))
        run("ccx", "model")
        stress = largest_stress((Path(folder) / "model.frd").read_text())
        force = reaction((Path(folder) / "model.dat").read_text())
    print(f"largest stress {stress:.2f}, known {STRESS:.2f}; reaction {force:.4f}, load {LOAD * AREA:.4f}")
    agrees = abs(stress / STRESS - 1) < 0.03 and abs(abs(force) / (LOAD * AREA) - 1) < 0.005
    return 0 if agrees else 1


sys.exit(main())
