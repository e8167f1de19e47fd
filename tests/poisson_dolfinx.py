#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""poisson_dolfinx.py PROGRAM SAMPLES: dolfinx computes on what subvol writes as XDMF.

1. A ball of curved hexes of order 2: Poisson's equation with a known solution, given on the boundary. The mesh is refined
   by halving its cells in their own coordinates, which leaves the ball what it is. With Lagrange spaces of degree k from
   2 to 4, the L2 error must fall with the power k + 1 of the size of the cells, to within 0.3.
2. A plate of linear hexes with groups of faces, read as tags of facets: the area of each is that of the report.

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
MOST_LOSS = 0.3  # of the power
REFINEMENTS = {2: (1, 2), 3: (1, 2), 4: (1, 2)}  # times that the two meshes of a degree are refined

try:
    import basix
    import numpy as np
    import ufl
    from dolfinx import fem, io, mesh
    from dolfinx.fem.petsc import LinearProblem
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


def halved(domain):
    """The same cells of order 2, each cut into eight in its own coordinates."""
    element = basix.create_element(basix.ElementFamily.P, basix.CellType.hexahedron, 2, basix.LagrangeVariant.equispaced)
    nodes, geometry = element.points, domain.geometry
    points, cells = [], []
    for cell in range(domain.topology.index_map(3).size_local):
        corners = geometry.x[geometry.dofmap.links(cell)]
        for corner in np.ndindex(2, 2, 2):
            at = (nodes + np.array(corner)) / 2
            shapes = element.tabulate(0, at)[0, :, :, 0]
            cells.append(np.arange(len(nodes)) + len(points) * len(nodes))
            points.append(shapes @ corners)
    points = np.concatenate(points)
    shifted = np.round((points + 0.1 / math.pi) * 1e9).astype(np.int64)  # so that no coordinate lies between two roundings
    _, first, place = np.unique(shifted, axis=0, return_index=True, return_inverse=True)
    vector = ufl.VectorElement("Lagrange", ufl.Cell("hexahedron", geometric_dimension=3), 2)
    return mesh.create_mesh(MPI.COMM_WORLD, place.reshape(-1)[np.array(cells)].astype(np.int64), points[first],
                            ufl.Mesh(vector))


def error_of(domain, degree):
    """L2 error of the solution, relative to it."""
    space = fem.FunctionSpace(domain, ("Lagrange", degree))
    x = ufl.SpatialCoordinate(domain)
    exact = ufl.sin(2 * x[0]) * ufl.cos(x[1]) * ufl.exp(x[2])
    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    domain.topology.create_connectivity(2, 3)
    facets = mesh.exterior_facet_indices(domain.topology)
    boundary = fem.Function(space)
    boundary.interpolate(lambda p: np.sin(2 * p[0]) * np.cos(p[1]) * np.exp(p[2]))
    condition = fem.dirichletbc(boundary, fem.locate_dofs_topological(space, 2, facets))
    dx = ufl.Measure("dx", domain=domain, metadata={"quadrature_degree": 2 * degree + 2})
    problem = LinearProblem(ufl.inner(ufl.grad(u), ufl.grad(v)) * dx, -ufl.div(ufl.grad(exact)) * v * dx, [condition],
                            petsc_options={"ksp_type": "cg", "pc_type": "jacobi", "ksp_rtol": 1e-12})
    solution = problem.solve()
    square = lambda form: fem.assemble_scalar(fem.form(form * dx))
    return math.sqrt(square((solution - exact) ** 2) / square(exact**2))


def check_rates(run, folder):
    run("fit", "ball_target.off", "--template", "ball_template.mesh", "--order", 2, "-o", "ball.xdmf", "--quiet")
    meshes = [read_mesh(folder / "ball.xdmf")]
    for _ in range(max(max(pair) for pair in REFINEMENTS.values())):
        meshes.append(halved(meshes[-1]))
    good = True
    for degree, (coarse, fine) in REFINEMENTS.items():
        errors = [error_of(meshes[level], degree) for level in (coarse, fine)]
        rate = math.log2(errors[0] / errors[1])
        print(f"degree {degree}: {[m.topology.index_map(3).size_local for m in (meshes[coarse], meshes[fine])]} cells, "
              f"errors {errors[0]:.3g} and {errors[1]:.3g}, rate {rate:.2f}")
        good = good and rate > degree + 1 - MOST_LOSS
    return good


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
        checks = [check(lambda *words: run(program, *words), folder) for check in (check_rates, check_groups)]
    return 0 if all(checks) else 1


if __name__ == "__main__":
    sys.exit(main())
