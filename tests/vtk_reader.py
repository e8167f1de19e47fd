# SPDX-License-Identifier: GPL-3.0-or-later
"""vtk_reader.py MESH.vtu QUERIES: evaluates the cells of a .vtu with VTK and compares.

A line of QUERIES: cell, VTK's cell type, number of its points, parametric coordinates u v w, position x y z.
Exit status: 0 all equal to 1e-12, 1 not, 77 no VTK here.
"""
import sys

try:
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
    from vtkmodules.vtkCommonCore import mutable
except ImportError:
    sys.exit(77)

reader = vtkXMLUnstructuredGridReader()
reader.SetFileName(sys.argv[1])
reader.Update()
grid = reader.GetOutput()
worst = 0.0
with open(sys.argv[2]) as queries:
    for line in queries:
        words = line.split()
        number, cell_type, num_points = (int(w) for w in words[:3])
        at = [float(w) for w in words[3:6]]
        expected = [float(w) for w in words[6:9]]
        cell = grid.GetCell(number)
        if cell is None or cell.GetCellType() != cell_type or cell.GetNumberOfPoints() != num_points:
            sys.exit("cell %d is of another type or has another number of points" % number)
        found = [0.0, 0.0, 0.0]
        cell.EvaluateLocation(mutable(0), at, found, [0.0] * num_points)
        error = max(abs(a - b) for a, b in zip(found, expected))
        if not error <= 1e-12:
            sys.exit("cell %d at %s: %s, expected %s" % (number, at, found, expected))
        worst = max(worst, error)
print("largest error", worst)
