# SPDX-License-Identifier: GPL-3.0-or-later
"""written_volumes.py PROGRAM SAMPLES: VTK and Gmsh read what the verbs write as .vtu and .msh, and find the same mesh.

Straight cells are compared with the .mesh written beside them, vertex by vertex and cell by cell; curved ones by their
nodes, which both files sample at the same places. Exit status 0: all agree to TOLERANCE of the extent; 1: not; 77: no
VTK or Gmsh here.
"""
import os
import subprocess
import sys
import tempfile

SYSTEM_PYTHON = "/usr/bin/python3"  # the one that Debian's packages are for
TOLERANCE = 1e-12
NUM_CORNERS = {"Hexahedra": 8, "Prisms": 6, "Tetrahedra": 4}
VTK_KINDS = {12: 8, 13: 6, 10: 4, 72: 8, 73: 6, 71: 4}
CASES = {  # name: command; all but the curved write NAME.mesh, NAME.vtu and NAME.msh
    "template": "convert torus_template.mesh -o template.mesh -o template.vtu -o template.msh",
    "tets": "template split bracket_template.mesh --into tets -o tets.mesh -o tets.vtu -o tets.msh",
    "prisms": "shell torus_target.off --thickness 2% -o prisms.mesh -o prisms.vtu -o prisms.msh",
    "fit": "fit ball_target.off --template ball_template.mesh --levels 1 -o fit.mesh -o fit.vtu -o fit.msh",
    "shell": "shell bowl.obj --thickness 4% --layers 2 --side both -o shell.mesh -o shell.vtu -o shell.msh",
    "repaired": "optimize tangled.mesh -o repaired.mesh -o repaired.vtu -o repaired.msh",
    "curved_hexes": "fit ball_target.off --template ball_template.mesh --order 3 --basis legendre -o curved_hexes.vtu "
                     "-o curved_hexes.msh",
    "curved_tets": "fit ball_target.off --template tets_of_ball.mesh --order 2 --basis legendre -o curved_tets.vtu "
                    "-o curved_tets.msh",
    "curved_shell": "shell bracket_template.mesh --thickness 4% --layers 1 --order 3 -o curved_shell.vtu "
                     "-o curved_shell.msh",
}

try:
    import gmsh
    import numpy as np
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
except (ImportError, OSError) as error:
    if os.path.exists(SYSTEM_PYTHON) and os.path.realpath(sys.executable) != os.path.realpath(SYSTEM_PYTHON):
        os.execv(SYSTEM_PYTHON, [SYSTEM_PYTHON, *sys.argv])
    print(f"SKIPPED: {error}; apt-get install python3-vtk9 python3-gmsh")
    sys.exit(77)


def read_medit(path):
    """Points, and the corners of all cells as a set."""
    words = [word for line in open(path) if not line.startswith("#") for word in line.split()]
    points, cells, at = None, set(), 0
    while at < len(words):
        if words[at] == "Vertices":
            count = int(words[at + 1])
            points = np.array(words[at + 2 : at + 2 + 4 * count], float).reshape(count, 4)[:, :3]
        elif words[at] in NUM_CORNERS:
            count, corners = int(words[at + 1]), NUM_CORNERS[words[at]]
            table = np.array(words[at + 2 : at + 2 + (corners + 1) * count], int).reshape(count, corners + 1)
            cells |= {frozenset(row[:-1] - 1) for row in table}
        at += 1
    return points, cells


def read_vtk(path):
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    points, cells = vtk_to_numpy(grid.GetPoints().GetData()).astype(float), []
    for c in range(grid.GetNumberOfCells()):
        cell = grid.GetCell(c)
        cells.append([cell.GetPointId(k) for k in range(VTK_KINDS[cell.GetCellType()])])
    return points, cells


def read_gmsh(path):
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(path)
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    place = {tag: i for i, tag in enumerate(tags)}
    cells = []
    for _, volume in gmsh.model.getEntities(3):
        for kind, elements, nodes in zip(*gmsh.model.mesh.getElements(3, volume)):
            _, _, _, count, _, corners = gmsh.model.mesh.getElementProperties(kind)
            cells += [[place[n] for n in nodes[count * e : count * e + corners]] for e in range(len(elements))]
    points = np.array(coordinates).reshape(-1, 3)
    gmsh.finalize()
    return points, cells


def largest_distance(a, b):
    """Of points of a from the closest of b."""
    parts = np.array_split(a, 1 + len(a) // 500)
    return max(np.sqrt(((part[:, None] - b) ** 2).sum(axis=2).min(axis=1)).max() for part in parts)


def compare_straight(name):
    points, cells = read_medit(f"{name}.mesh")
    worst = 0
    for found, corners in (read_vtk(f"{name}.vtu"), read_gmsh(f"{name}.msh")):
        assert found.shape == points.shape, f"{name}: {len(found)} points, expected {len(points)}"
        assert {frozenset(c) for c in corners} == cells and len(corners) == len(cells), f"{name}: other cells"
        worst = max(worst, np.abs(found - points).max())
    return worst / np.ptp(points, axis=0).max(), len(cells)


def compare_curved(name):
    (of_vtk, vtk_cells), (of_gmsh, gmsh_cells) = read_vtk(f"{name}.vtu"), read_gmsh(f"{name}.msh")
    assert len(vtk_cells) == len(gmsh_cells), f"{name}: {len(vtk_cells)} and {len(gmsh_cells)} cells"
    worst = max(largest_distance(of_vtk, of_gmsh), largest_distance(of_gmsh, of_vtk))
    return worst / np.ptp(of_vtk, axis=0).max(), len(vtk_cells)


def main():
    program, samples = map(os.path.abspath, sys.argv[1:3])
    failed = False
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        subprocess.run([samples, "."], check=True)
        run = lambda words: subprocess.run([program, *words.split(), "--quiet"], check=True)
        run("template split ball_template.mesh --into tets -o tets_of_ball.mesh")
        for name, words in CASES.items():
            run(words)
            worst, cells = (compare_straight if os.path.exists(f"{name}.mesh") else compare_curved)(name)
            print(f"{name}: {cells} cells, largest deviation {worst:.2g} of the extent")
            failed = failed or not worst <= TOLERANCE
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
