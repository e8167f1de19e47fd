#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""in_dolfinx.py PROGRAM SAMPLES: dolfinx computes on what subvol writes as XDMF and as .msh.

A plate of linear hexes with groups of faces is read from XDMF, the groups as tags of facets: the area of each must be
that of the report. Balls of hexes of order 2 are read from .msh by way of Gmsh (Debian's dolfinx reads no such hexes from
XDMF, and knows none of order 3): Poisson's equation with a known solution, given on the boundary, is solved with Lagrange
elements of degree 2 on 448 and 3,584 cells, and the L2 error must fall with the power 3 of the size of the cells, to within
0.3. Without Gmsh's Python module, this part is left out.

Exit status 0 if all is so, 1 if not, 77 if there is no dolfinx.
"""
import json
import math
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
    import numpy as np
    import ufl
    from dolfinx import fem, io, mesh
    from mpi4py import MPI
except ImportError as error:
    if os.path.exists(SYSTEM_PYTHON) and os.path.realpath(sys.executable) != os.path.realpath(SYSTEM_PYTHON):
        os.execv(SYSTEM_PYTHON, [SYSTEM_PYTHON, *sys.argv])
    print(f"SKIPPED: {error}; apt-get install python3-dolfinx")
    sys.exit(77)

MOST_LOSS = 0.3  # of the power
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


def error_on(domain, degree):
    """L2 error of the solution of Poisson's equation, relative to it."""
    space = fem.FunctionSpace(domain, ("Lagrange", degree))
    x = ufl.SpatialCoordinate(domain)
    exact = ufl.sin(2 * x[0]) * ufl.cos(x[1]) * ufl.exp(x[2])  # minus its Laplacian is 4 times itself
    given = fem.Function(space)
    given.interpolate(lambda p: np.sin(2 * p[0]) * np.cos(p[1]) * np.exp(p[2]))
    domain.topology.create_connectivity(2, 3)
    facets = mesh.exterior_facet_indices(domain.topology)
    edge = fem.dirichletbc(given, fem.locate_dofs_topological(space, 2, facets))
    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    problem = fem.petsc.LinearProblem(ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx, 4 * exact * v * ufl.dx, [edge],
                                      petsc_options={"ksp_type": "cg", "pc_type": "jacobi", "ksp_rtol": 1e-10})
    found = problem.solve()
    square = lambda expression: fem.assemble_scalar(fem.form(expression**2 * ufl.dx(degree=2 * degree + 2)))
    return math.sqrt(square(found - exact) / square(exact))


def check_rate(run, folder):
    try:
        import gmsh
        from dolfinx.io import gmshio
    except ImportError as error:
        print(f"left out: {error}; apt-get install python3-gmsh")
        return True
    errors, cells = [], []
    for levels in (2, 3):
        run("subdivide", "ball_template.mesh", "--boundary", "linear", "--levels", levels, "-o", "start.mesh", "--force",
            "--quiet")
        run("fit", "ball_target.off", "--template", "start.mesh", "--order", 2, "-o", "ball.msh", "--force", "--quiet")
        gmsh.initialize()
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(folder / "ball.msh"))
        domain = gmshio.model_to_mesh(gmsh.model, MPI.COMM_WORLD, 0)[0]
        gmsh.finalize()
        cells.append(domain.topology.index_map(3).size_local)
        errors.append(error_on(domain, 2))
    rate = math.log2(errors[0] / errors[1])
    print(f"degree 2: {cells[0]} and {cells[1]} cells of order 2, errors {errors[0]:.3g} and {errors[1]:.3g}, rate {rate:.2f}")
    return rate > 3 - MOST_LOSS


def main():
    program, samples = (Path(path).resolve() for path in sys.argv[1:3])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run = lambda *words: subprocess.run([str(word) for word in words], cwd=folder, check=True,
                                            env=dict(os.environ, OMP_NUM_THREADS="1"))
        run(samples, ".")
        checks = [check(lambda *words: run(program, *words), folder) for check in (check_groups, check_rate)]
    return 0 if all(checks) else 1


if __name__ == "__main__":
    sys.exit(main())
