#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""poisson_getfem.py PROGRAM SAMPLES: GetFEM computes on curved cells that subvol writes as .msh of version 2.2.

The ball of hexes of order 2 is read and refined by halving its cells in their own coordinates, which leaves the ball what
it is. Poisson's equation with a known solution, given on the boundary: with Lagrange elements of degree 2 and 3, the L2
error must fall with the power degree + 1 of the size of the cells, to within 0.3. (GetFEM reads no hexes of order 3 or
more from .msh.)

Exit status 0 if it does, 1 if not, 77 if there is no GetFEM.
"""
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

SYSTEM_PYTHON = "/usr/bin/python3"  # the one that Debian's packages are for
MOST_LOSS = 0.3  # of the power
REFINEMENTS = {2: (1, 2), 3: (1, 2)}  # times that the two meshes of a degree are refined
EXACT = "(sin(2*X(1))*cos(X(2))*exp(X(3)))"  # minus its Laplacian is 4 times itself

try:
    import getfem
    import numpy as np
except ImportError as error:
    if os.path.exists(SYSTEM_PYTHON) and os.path.realpath(sys.executable) != os.path.realpath(SYSTEM_PYTHON):
        os.execv(SYSTEM_PYTHON, [SYSTEM_PYTHON, *sys.argv])
    print(f"SKIPPED: {error}; apt-get install python3-getfem")
    sys.exit(77)


def shapes_at(points):
    """Values of the 27 shape functions of GT_QK(3,2), whose nodes run along x fastest, at points of the unit cube."""
    line = lambda t: np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)], axis=1)
    x, y, z = (line(points[:, k]) for k in range(3))
    return np.einsum("pk,pj,pi->pkji", z, y, x).reshape(len(points), 27)


def halved(mesh):
    """The same cells, each cut into eight in its own coordinates."""
    steps = np.linspace(0, 1, 3)
    nodes = np.array([(x, y, z) for z in steps for y in steps for x in steps])
    finer = getfem.Mesh("empty", 3)
    for cell in mesh.cvid():
        corners = mesh.pts_from_cvid(cell)[0].T
        for corner in np.ndindex(2, 2, 2):
            finer.add_convex(getfem.GeoTrans("GT_QK(3,2)"), (shapes_at((nodes + np.array(corner)) / 2) @ corners).T)
    return finer


def error_of(mesh, degree):
    """L2 error of the solution, relative to it."""
    space = getfem.MeshFem(mesh, 1)
    space.set_fem(getfem.Fem(f"FEM_QK(3,{degree})"))
    points = getfem.MeshIm(mesh, getfem.Integ(f"IM_GAUSS_PARALLELEPIPED(3,{2 * degree + 2})"))
    mesh.set_region(99, mesh.outer_faces())
    x, y, z = space.basic_dof_nodes()
    model = getfem.Model("real")
    model.add_fem_variable("u", space)
    model.add_linear_term(points, "Grad_u.Grad_Test_u")
    model.add_source_term(points, f"4*{EXACT}*Test_u")
    model.add_initialized_fem_data("given", space, np.sin(2 * x) * np.cos(y) * np.exp(z))
    model.add_Dirichlet_condition_with_simplification("u", 99, "given")
    model.solve()
    square = lambda expression: float(np.asarray(getfem.asm_generic(points, 0, expression, -1, model)).reshape(-1)[0])
    return math.sqrt(square(f"sqr(u-{EXACT})") / square(f"sqr({EXACT})"))


def main():
    program, samples = (Path(path).resolve() for path in sys.argv[1:3])
    good = True
    with tempfile.TemporaryDirectory() as folder:
        run = lambda *words: subprocess.run([str(word) for word in words], cwd=folder, check=True,
                                            env=dict(os.environ, OMP_NUM_THREADS="1"))
        run(samples, ".")
        run(program, "fit", "ball_target.off", "--template", "ball_template.mesh", "--order", 2, "--msh-version", "2.2", "-o",
            "ball.msh", "--quiet")
        meshes = [getfem.Mesh("import", "gmsh", str(Path(folder) / "ball.msh"))]
        assert meshes[0].geotrans(0)[0].char() == "GT_QK(3,2)"
    for _ in range(max(max(pair) for pair in REFINEMENTS.values())):
        meshes.append(halved(meshes[-1]))
    for degree, (coarse, fine) in REFINEMENTS.items():
        errors = [error_of(meshes[level], degree) for level in (coarse, fine)]
        rate = math.log2(errors[0] / errors[1])
        print(f"degree {degree}: {meshes[coarse].nbcvs()} and {meshes[fine].nbcvs()} cells, errors {errors[0]:.3g} and "
              f"{errors[1]:.3g}, rate {rate:.2f}")
        good = good and rate > degree + 1 - MOST_LOSS
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
