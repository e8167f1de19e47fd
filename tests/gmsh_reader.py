# SPDX-License-Identifier: GPL-3.0-or-later
"""gmsh_reader.py MESH.msh QUERIES: looks with Gmsh where the nodes of the cells of a .msh are, and compares.

A line of QUERIES: Gmsh's element type, element number, order, canonical coordinates u v w, position x y z.
Exit status: 0 all equal to 1e-12, 1 not, 77 no Gmsh here.
"""
import sys

try:
    import gmsh
except (ImportError, OSError):
    sys.exit(77)

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.open(sys.argv[1])
tags, coordinates, _ = gmsh.model.mesh.getNodes()
position = {tag: coordinates[3 * i:3 * i + 3] for i, tag in enumerate(tags)}
nodes = {}  # (element type, number, lattice point) -> position
for _, volume in gmsh.model.getEntities(3):
    for element_type, elements, all_tags in zip(*gmsh.model.mesh.getElements(3, volume)):
        name, _, order, count, local, _ = gmsh.model.mesh.getElementProperties(element_type)
        for e, element in enumerate(elements):
            for k in range(count):
                at = list(local[3 * k:3 * k + 3])
                if name.startswith("Hexahedron"):
                    at = [(x + 1) / 2 for x in at]
                elif name.startswith("Prism"):
                    at[2] = (at[2] + 1) / 2
                key = (element_type, element) + tuple(round(order * x) for x in at)
                nodes[key] = position[all_tags[count * e + k]]
with open(sys.argv[2]) as queries:
    num_queries = 0
    for line in queries:
        words = line.split()
        element_type, element, order = (int(w) for w in words[:3])
        at = tuple(round(order * float(w)) for w in words[3:6])
        expected = [float(w) for w in words[6:9]]
        found = nodes.get((element_type, element) + at)
        if found is None or max(abs(a - b) for a, b in zip(found, expected)) > 1e-12:
            sys.exit("element %d at %s: %s, expected %s" % (element, at, found, expected))
        num_queries += 1
if num_queries != len(nodes):
    sys.exit("%d nodes of elements, expected %d" % (len(nodes), num_queries))
gmsh.finalize()
