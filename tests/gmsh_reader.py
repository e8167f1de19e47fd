# SPDX-License-Identifier: GPL-3.0-or-later
"""gmsh_reader.py MESH.msh QUERIES: evaluates the elements of a .msh with Gmsh's shape functions and compares.

A line of QUERIES: Gmsh's element type, element number, canonical coordinates u v w, position x y z, and the nine numbers
dx/du, column by column (derivatives by u, by v, by w). All elements of a type are asked about at the same points.
Prints the largest differences for every type. Exit status: 0 all agree to `tolerance`, 1 not, 77 no Gmsh here.
"""
import collections
import sys

try:
    import gmsh
    import numpy as np
except (ImportError, OSError):
    sys.exit(77)


def local(name, at):
    """Gmsh's coordinates of canonical ones, and what the derivatives by the former are multiplied with."""
    centered = (0, 1, 2) if name.startswith("Hexahedron") else (2,) if name.startswith("Prism") else ()
    result, scale = np.array(at), np.ones(3)
    for axis in centered:
        result[:, axis] = 2 * result[:, axis] - 1
        scale[axis] = 2
    return result, scale


def tolerance(order):
    """Of positions, by the size of a cell. Gmsh evaluates its shape functions through the inverse of a Vandermonde matrix
    of monomials, and so loses about 1.75 digits with each order: 1e-13 at order 4, 3e-4 for hexes of order 9."""
    return 10.0 ** (-18.5 + 1.75 * max(order, 3))


def main():
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(sys.argv[1])
    queries = collections.defaultdict(lambda: collections.defaultdict(list))
    with open(sys.argv[2]) as lines:
        for line in lines:
            words = line.split()
            queries[int(words[0])][int(words[1])].append([float(w) for w in words[2:]])
    num_compared = 0
    for element_type, elements in queries.items():
        name, _, order = gmsh.model.mesh.getElementProperties(element_type)[:3]
        numbers, _ = gmsh.model.mesh.getElementsByType(element_type)
        at, scale = local(name, [row[:3] for row in next(iter(elements.values()))])
        jacobians, _, positions = gmsh.model.mesh.getJacobians(element_type, at.ravel())
        jacobians = jacobians.reshape(len(numbers), len(at), 3, 3) * scale[:, None]  # rows: derivatives by u, v, w
        positions = positions.reshape(len(numbers), len(at), 3)
        worst = [0.0, 0.0]
        for i, number in enumerate(numbers):
            expected = np.array(elements[int(number)])
            worst[0] = max(worst[0], np.abs(positions[i] - expected[:, 3:6]).max())
            worst[1] = max(worst[1], np.abs(jacobians[i].reshape(-1, 9) - expected[:, 6:15]).max())
            num_compared += 1
        print("%s: largest differences %.2g (positions), %.2g (derivatives)" % (name, *worst))
        if not (worst[0] <= tolerance(order) and worst[1] <= 30 * tolerance(order)):
            sys.exit("%s differs" % name)
    num_elements = sum(len(found) for _, found, _ in [gmsh.model.mesh.getElements(3)] for found in found)
    if num_compared != num_elements:
        sys.exit("%d elements compared, but the file has %d" % (num_compared, num_elements))
    gmsh.finalize()


main()
