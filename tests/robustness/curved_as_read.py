# SPDX-License-Identifier: GPL-3.0-or-later
"""curved_as_read.py PROGRAM DATA [--orders 2 4 8] [--adaptive 12] [--basis legendre] [--cases NAME ..] [--keep FOLDER]
                  [--time-limit SECONDS]

Fits every case of a folder (DATA/NAME/target.off and template.mesh) with curved cells, and judges what VTK reconstructs
from the .vtu: the scaled Jacobian of every cell at the points where the report samples it, and on a grid of 9 points in
each direction. One line for each fit. Exit status: 0 no cell is inverted as VTK sees it, and the least scaled Jacobian is
that of the report to 1e-6; 1 not; 77 no VTK here.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile

SYSTEM_PYTHON = "/usr/bin/python3"  # the one that Debian's packages are for
AGREEMENT = 1e-6
CORNERS = {71: 4, 72: 8, 73: 6}

try:
    import numpy as np
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
except ImportError as error:
    if os.path.exists(SYSTEM_PYTHON) and os.path.realpath(sys.executable) != os.path.realpath(SYSTEM_PYTHON):
        os.execv(SYSTEM_PYTHON, [SYSTEM_PYTHON, *sys.argv])
    print(f"SKIPPED: {error}; apt-get install python3-vtk9")
    sys.exit(77)


def grid_points(kind, n):
    """The regular grid of n points in each direction, in VTK's parametric coordinates."""
    steps = np.linspace(0, 1, n)
    points = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    if kind == 71:
        return points[points.sum(axis=1) <= 1 + 1e-12]
    return points[points[:, :2].sum(axis=1) <= 1 + 1e-12] if kind == 73 else points


def ideal_inverse(kind):
    """Inverse of the map from the canonical to the ideal cell: regular tetrahedron, prism over one of its faces, cube."""
    ideal = np.eye(3)
    if kind != 72:
        ideal[:, 1] = [0.5, np.sqrt(3) / 2, 0]
    if kind == 71:
        ideal[:, 2] = [0.5, np.sqrt(3) / 6, np.sqrt(2 / 3)]
    return np.linalg.inv(ideal)


class Cells:
    """Scaled Jacobians of the cells of a file by VTK's shape functions."""

    def __init__(self, path):
        reader = vtkXMLUnstructuredGridReader()
        reader.SetFileName(path)
        reader.Update()
        self.grid = reader.GetOutput()
        self.tables = {}

    def derivatives(self, cell, kind, count, n):
        if (kind, count, n) not in self.tables:
            rows = []
            for at in grid_points(kind, n):
                values = [0.0] * (3 * count)
                cell.InterpolateDerivs(list(at), values)
                values = np.array(values)  # VTK lists them point by point for hexes, else axis by axis
                rows.append(values.reshape(count, 3).T if kind == 72 else values.reshape(3, count))
            self.tables[kind, count, n] = np.array(rows)
        return self.tables[kind, count, n]

    def minima(self, samples):
        """The least scaled Jacobian of every cell, on a grid of samples(order) points in each direction."""
        result = []
        for c in range(self.grid.GetNumberOfCells()):
            cell = self.grid.GetCell(c)
            kind, count = cell.GetCellType(), cell.GetNumberOfPoints()
            order = 1
            while nodes_of(kind, order) < count:
                order += 1
            table = self.derivatives(cell, kind, count, samples(order))
            points = vtk_to_numpy(cell.GetPoints().GetData())
            jacobians = np.einsum("kx,qdk->qxd", points, table) @ ideal_inverse(kind)
            lengths = np.linalg.norm(jacobians, axis=1).prod(axis=1)
            result.append((np.linalg.det(jacobians) / lengths).min())
        return np.array(result)


def nodes_of(kind, order):
    n = order + 1
    return {71: n * (n + 1) * (n + 2) // 6, 72: n**3, 73: n * n * (n + 1) // 2}[kind]


def judge(program, folder, name, words, out):
    vtu, report = os.path.join(out, f"{name}.vtu"), os.path.join(out, f"{name}.json")
    command = [program, "fit", f"{folder}/target.off", "--template", f"{folder}/template.mesh", *words, "-o", vtu,
               "--report", report, "--quiet", "--force"]
    status = subprocess.run(command).returncode
    if not os.path.exists(report) or not os.path.exists(vtu):
        print(f"{name} {' '.join(words)}: status {status}, no result", flush=True)
        return status not in (2, 3)
    with open(report) as file:
        said = json.load(file)
    written = said.get("polynomial_cells", [said])[0]
    cells = Cells(vtu)
    dense, sampled = cells.minima(lambda order: 9), cells.minima(lambda order: max(5, 2 * order + 3))
    least = written["quality"]["min_scaled_jacobian"]
    agrees = abs(sampled.min() - least) <= AGREEMENT
    print(f"{name} {' '.join(words)}: status {status}, mean {written['distance']['mean_percent']:.4f} %, max "
          f"{written['distance']['max_percent']:.3f} %, certified {written['quality']['certified_cells']} of "
          f"{len(dense)}, least scaled Jacobian {least:.6f}; VTK: inverted {(dense <= 0).sum()}, least "
          f"{sampled.min():.6f} at the same points, {dense.min():.6f} on the dense grid; "
          f"map {written.get('distance_from_map_percent', 0):.2g} %; {said['seconds']['total']:.0f} s", flush=True)
    claims = status in (0, 4)
    return agrees and not (claims and (dense <= 0).any())


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("data")
    parser.add_argument("--orders", type=int, nargs="*", default=[2, 4, 8])
    parser.add_argument("--adaptive", type=int, nargs="*", default=[])
    parser.add_argument("--basis", default="legendre")
    parser.add_argument("--cases", nargs="*")
    parser.add_argument("--keep")
    parser.add_argument("--time-limit", help="of each fit; what it has reached by then is judged")
    arguments = parser.parse_args()
    runs = [["--order", str(p)] for p in arguments.orders]
    runs += [["--order", str(p), "--adaptive"] for p in arguments.adaptive]
    more = ["--basis", arguments.basis]
    if arguments.time_limit:
        more += ["--time-limit", arguments.time_limit]
    all_right = True
    with tempfile.TemporaryDirectory() as folder:
        out = arguments.keep or folder
        os.makedirs(out, exist_ok=True)
        for name in arguments.cases or sorted(os.listdir(arguments.data)):
            case = os.path.join(arguments.data, name)
            if not os.path.exists(os.path.join(case, "target.off")):
                continue
            for words in runs:
                all_right = judge(arguments.program, case, name, [*words, *more], out) and all_right
    return 0 if all_right else 1


if __name__ == "__main__":
    sys.exit(main())
