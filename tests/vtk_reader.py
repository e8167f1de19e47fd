# SPDX-License-Identifier: GPL-3.0-or-later
"""vtk_reader.py MESH QUERIES: evaluates the cells of a .vtu or Exodus .e with VTK's shape functions and compares.

A line of QUERIES: cell, VTK's cell type, number of its points, parametric coordinates u v w, position x y z, and if the
line goes on the nine numbers dx/du, column by column (derivatives by u, by v, by w).
Prints the largest differences for every type and number of points. Exit status: 0 all positions are equal to
POSITION_TOLERANCE and all derivatives to DERIVATIVE_TOLERANCE, 1 not, 77 no VTK here.
"""
import collections
import sys

# The points of a file are rounded to 1e-16 of the coordinates. Interpolation through regular grids amplifies that, by
# up to 1e5 for positions and 1e6 for derivatives at order 12.
POSITION_TOLERANCE = 1e-10
EXODUS_TOLERANCE = 1e-6  # VTK reads the points of Exodus in single precision
DERIVATIVE_TOLERANCE = 1e-8
FIRST_BEZIER = 78  # VTK 9.1 leaves the derivatives of Bezier cells uninitialized: only their positions are compared

try:
    import numpy as np
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOExodus import vtkExodusIIReader
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
    from vtkmodules.vtkCommonCore import mutable
except ImportError:
    sys.exit(77)


def derivatives(cell, at, count):
    """d N_k / d(u, v, w): one row per point of the cell. VTK lists them point by point for hexes, else axis by axis."""
    values = [0.0] * (3 * count)
    cell.InterpolateDerivs(at, values)
    values = np.array(values)
    return values.reshape(count, 3) if cell.GetCellType() == 72 else values.reshape(3, count).T


def cells_of(path):
    """The cells of a file; those of Exodus block by block. VTK reuses its cells: each is fetched where it is needed."""
    reader = vtkExodusIIReader() if path.endswith(".e") else vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    grids = [reader.GetOutput()]
    if path.endswith(".e"):
        blocks = reader.GetOutput().GetBlock(0)
        grids = [blocks.GetBlock(b) for b in range(blocks.GetNumberOfBlocks())]
    return [(grid, c) for grid in grids for c in range(grid.GetNumberOfCells())]


def main():
    cells = cells_of(sys.argv[1])
    tolerance = EXODUS_TOLERANCE if sys.argv[1].endswith(".e") else POSITION_TOLERANCE
    worst = collections.defaultdict(lambda: [0.0, 0.0])
    with open(sys.argv[2]) as queries:
        for line in queries:
            words = line.split()
            number, cell_type, num_points = (int(w) for w in words[:3])
            at, expected = [float(w) for w in words[3:6]], np.array([float(w) for w in words[6:]])
            grid, place = cells[number] if number < len(cells) else (None, 0)
            cell = grid.GetCell(place) if grid else None
            if cell is None or cell.GetCellType() != cell_type or cell.GetNumberOfPoints() != num_points:
                sys.exit("cell %d is of another type or has another number of points" % number)
            found = [0.0, 0.0, 0.0]
            cell.EvaluateLocation(mutable(0), at, found, [0.0] * num_points)
            errors = [np.abs(np.array(found) - expected[:3]).max(), 0.0]
            if len(expected) > 3 and cell_type < FIRST_BEZIER:
                points = vtk_to_numpy(cell.GetPoints().GetData())
                jacobian = points.T @ derivatives(cell, at, num_points)
                errors[1] = np.abs(jacobian.T.reshape(9) - expected[3:]).max()
            if not (errors[0] <= tolerance and errors[1] <= DERIVATIVE_TOLERANCE):
                sys.exit("cell %d at %s: differs by %s" % (number, at, errors))
            entry = worst[cell_type, num_points]
            entry[:] = np.maximum(entry, errors)
    for (cell_type, num_points), errors in sorted(worst.items()):
        print("type %d, %4d points: largest differences %.2g (positions), %.2g (derivatives)"
              % (cell_type, num_points, *errors))


main()
