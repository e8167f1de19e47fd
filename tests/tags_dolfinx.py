#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""tags_dolfinx.py PROGRAM SAMPLES: dolfinx computes on what subvol writes as XDMF.

A plate of linear hexes with groups of faces is read, the groups as tags of facets: the area of each must be that of the
report. (Debian's dolfinx reads no hexes of order 2 from XDMF; poisson_getfem.py has the rates of curved cells.)

Exit status 0 if all is so, 1 if not, 77 if there is no dolfinx.
"""
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

SYSTEM_PYTHON = "/usr/bin/python3"  # the one that Debian's packages are for

# What dolfinx compiles is kept in a folder of its own: one that an interrupted run has left unfinished is an error.
CACHE = tempfile.TemporaryDirectory()
os.environ["XDG_CACHE_HOME"] = CACHE.name

try:
    import ufl
    from dolfinx import fem, io
    from mpi4py import MPI
except ImportError as error:
    if os.path.exists(SYSTEM_PYTHON) and os.path.realpath(sys.executable) != os.path.realpath(SYSTEM_PYTHON):
        os.execv(SYSTEM_PYTHON, [SYSTEM_PYTHON, *sys.argv])
    print(f"SKIPPED: {error}; apt-get install python3-dolfinx")
    sys.exit(77)

ASCII = io.XDMFFile.Encoding.ASCII  # the numbers stand in the text, not in a file of HDF5


def read_mesh(path):
    with io.XDMFFile(MPI.COMM_WORLD, str(path), "r", encoding=ASCII) as file:
        return file.read_mesh(name="mesh")


def check_groups(run, folder):
    run("fit", "plate.obj", "--cells", 500, "-o", "plate.xdmf", "-o", "boundary:plate_faces.xdmf", "--report", "plate.json",
        "--quiet")
    domain = read_mesh(folder / "plate.xdmf")
    domain.topology.create_connectivity(2, 3)
    with io.XDMFFile(MPI.COMM_WORLD, str(folder / "plate_faces.xdmf"), "r", encoding=ASCII) as file:
        tags = file.read_meshtags(domain, name="groups")
    ds = ufl.Measure("ds", domain=domain, subdomain_data=tags)
    good = True
    for group in json.loads((folder / "plate.json").read_text())["groups"]:
        area = fem.assemble_scalar(fem.form(fem.Constant(domain, 1.0) * ds(group["number"])))
        print(f"{group['name']}: area {area:.9g}, in the report {group['area']:.9g}")
        good = good and abs(area - group["area"]) < 1e-3 * group["area"]
    return good


def main():
    program, samples = (Path(path).resolve() for path in sys.argv[1:3])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run = lambda *words: subprocess.run([str(word) for word in words], cwd=folder, check=True,
                                            env=dict(os.environ, OMP_NUM_THREADS="1"))
        run(samples, ".")
        checks = [check(lambda *words: run(program, *words), folder) for check in (check_groups,)]
    return 0 if all(checks) else 1


if __name__ == "__main__":
    sys.exit(main())
