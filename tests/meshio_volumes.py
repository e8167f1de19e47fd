#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""meshio_volumes.py PROGRAM SAMPLES: meshio reads linear cells with groups of faces from every format that it shares
with subvol, and finds the same points and cells in each.

Exit status 0 if all agree, 1 if not, 77 if there is no meshio.
"""
import importlib.util
import os
import subprocess
import sys
import tempfile
from pathlib import Path

SYSTEM_PYTHON = "/usr/bin/python3"  # the one that Debian's packages are for
FORMATS = ("mesh", "vtk", "vtu", "msh", "inp", "bdf", "xdmf", "e")
OLD_MSH = "old.msh"  # of version 2.2
NEEDED_MODULES = {"e": "netCDF4", "xdmf": "h5py"}  # what meshio needs for some formats

try:
    import meshio
    import numpy as np
except ImportError as error:
    if os.path.exists(SYSTEM_PYTHON) and os.path.realpath(sys.executable) != os.path.realpath(SYSTEM_PYTHON):
        os.execv(SYSTEM_PYTHON, [SYSTEM_PYTHON, *sys.argv])
    print(f"SKIPPED: {error}; apt-get install python3-meshio")
    sys.exit(77)


def hexes_of(path):
    """The corners of all hexes as points: (n, 8, 3)."""
    mesh = meshio.read(path)
    return np.concatenate([mesh.points[block.data] for block in mesh.cells if block.type == "hexahedron"])


def main():
    program, samples = (Path(path).resolve() for path in sys.argv[1:3])
    status = 0
    with tempfile.TemporaryDirectory() as folder:
        run = lambda *words: subprocess.run([str(word) for word in words], cwd=folder, check=True,
                                            env=dict(os.environ, OMP_NUM_THREADS="1"))
        run(samples, ".")
        outputs = [word for name in FORMATS for word in ("-o", f"plate.{name}")]
        run(program, "fit", "plate.obj", "--cells", 500, *outputs, "--quiet")
        run(program, "convert", "plate.mesh", "--msh-version", "2.2", "-o", f"plate.{OLD_MSH}", "-o",
            "boundary:faces.vtu", "-o", "boundary:faces.vtk", "--quiet")
        wanted = hexes_of(Path(folder) / "plate.mesh")
        for name in (*FORMATS, OLD_MSH):
            module = NEEDED_MODULES.get(name)
            if module and not importlib.util.find_spec(module):
                print(f"plate.{name}: SKIPPED: no {module}; apt-get install python3-{module.lower()}")
                continue
            try:
                found = hexes_of(Path(folder) / f"plate.{name}")
                agrees = found.shape == wanted.shape and np.abs(found - wanted).max() < 1e-7
                print(f"plate.{name}: {len(found)} hexes, {'the same' if agrees else 'NOT THE SAME'}")
            except (Exception, SystemExit) as error:  # meshio ends the program where it does not know a file
                agrees = False
                print(f"plate.{name}: NOT READ: {error!r}")
            status |= not agrees
        for name in ("faces.vtu", "faces.vtk"):
            try:
                faces = meshio.read(Path(folder) / name)
                named = [number for block in faces.cell_data["group"] for number in np.ravel(block)]
                agrees = len(named) > 0 and min(named) >= 1
                print(f"{name}: {len(named)} faces, {'all of them in groups' if agrees else 'NOT IN GROUPS'}")
            except (Exception, SystemExit) as error:
                agrees = False
                print(f"{name}: NOT READ: {error!r}")
            status |= not agrees
    return status


sys.exit(main())
