# SPDX-License-Identifier: GPL-3.0-or-later
"""Control cages from Medit files, as subvol writes them: the boundary of the cells, with its creases and corners."""

# Faces of each kind of cell, outward; corners are numbered as in Medit.
CELLS = {
    "Tetrahedra": (4, ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))),
    "Prisms": (6, ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))),
    "Hexahedra": (8, ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))),
}
SECTIONS = {"Vertices": 4, "Edges": 3, "Ridges": 1, "Corners": 1, "RequiredVertices": 1, "RequiredEdges": 1,
            "Triangles": 4, "Quadrilaterals": 5, **{name: corners + 1 for name, (corners, _) in CELLS.items()}}
INFINITE = 10.0  # sharpness from which features never soften


class CageError(Exception):
    """A file that is no cage; the message names it."""


class Cage:
    """points: of the boundary; faces: numbers into them, outward; creases, corners: sharpness by edge and by point."""

    def __init__(self, points, faces, creases, corners):
        self.points, self.faces, self.creases, self.corners = points, faces, creases, corners


def read_cage(path):
    """Reads a cage. CageError: a file that holds none."""
    with open(path) as file:
        text = file.read()
    try:
        sections, sharpness = parse(text)
        return boundary(sections, sharpness)
    except (ValueError, IndexError, KeyError) as error:
        raise CageError(f"{path}: no control cage in Medit's text format ({error})") from error


def parse(text):
    """Rows of numbers by section; sharpness of edges and of points by number from 1, from the comments."""
    words, sharpness = [], {"Ridge": {}, "Corner": {}}
    for line in text.splitlines():
        content, _, comment = line.partition("#")
        words += content.split()
        for what, found in sharpness.items():
            if comment.startswith(f"subvol:{what}Sharpness"):
                number, value = comment.split()[1:3]
                found[int(number)] = float(value)
    sections, place = {}, 0
    while place < len(words) and words[place] != "End":
        name = words[place]
        if name in ("MeshVersionFormatted", "Dimension"):
            place += 2
            continue
        if name not in SECTIONS:
            raise ValueError(f"unknown word {name!r}")
        count, width = int(words[place + 1]), SECTIONS[name]
        begin, place = place + 2, place + 2 + count * width
        if place > len(words):
            raise ValueError(f"{name} end too early")
        number = float if name == "Vertices" else int
        sections[name] = [[number(w) for w in words[i : i + width]] for i in range(begin, place, width)]
    return sections, sharpness


def boundary(sections, sharpness):
    faces = {}
    for name, (corners, local_faces) in CELLS.items():
        for row in sections.get(name, ()):
            for local in local_faces:
                face = [row[i] for i in local]
                key = tuple(sorted(face))
                faces[key] = None if key in faces else face  # seen from both sides: inside
    outer = [face for face in faces.values() if face]
    if not outer:
        raise ValueError("there are no cells")
    vertices = sections["Vertices"]
    used = sorted({v for face in outer for v in face})
    if used[0] < 1 or used[-1] > len(vertices):
        raise ValueError("a cell names a vertex that is not there")
    number = {v: i for i, v in enumerate(used)}
    creases = {}
    for (edge,) in sections.get("Ridges", ()):
        a, b = sections["Edges"][edge - 1][:2]
        if a in number and b in number:
            creases[tuple(sorted((number[a], number[b])))] = sharpness["Ridge"].get(edge, INFINITE)
    corners = {number[v]: sharpness["Corner"].get(v, INFINITE) for (v,) in sections.get("Corners", ()) if v in number}
    points = [tuple(vertices[v - 1][:3]) for v in used]
    return Cage(points, [[number[v] for v in face] for face in outer], creases, corners)
