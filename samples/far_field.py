#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fills the space between a sheet of triangles and a box around it with tets, by means of Gmsh.

far_field.py LAYERS.msh -o FAR.msh [--margin PERCENT | --box X0 Y0 Z0 X1 Y1 Z1] [options]

LAYERS.msh is a file of `subvol shell`, whose group `outer` is the sheet, or any other file of triangles that Gmsh
reads. The triangles of the sheet become faces of tets as they are, so that `subvol template merge LAYERS.msh FAR.msh`
makes one mesh of both. The sheet may be open if each loop of its border lies in a plane perpendicular to an axis: then
a face of the box lies in that plane, and the loop is a hole in it. docs/tasks/boundary-layers.md explains the steps.

Exit status 0 if the file was written, 1 if the space cannot be filled, 2 for wrong options, 77 if there is no Gmsh.
"""
import argparse
import os
import sys

SYSTEM_PYTHON = "/usr/bin/python3"  # the one that Debian's packages are for
FACES = ("x-", "x+", "y-", "y+", "z-", "z+")
NAMES = {"x-": "inlet", "x+": "outlet"}  # of faces that --name does not name
FAR, SYMMETRY = "far", "symmetry"        # of the others, and of those with a hole
GROWTH = 0.25                            # of the edge length by distance, for the default of --size
FLATNESS = 1e-9                          # of the border of a sheet, by its diagonal
TRIANGLE, QUAD, TET = 2, 3, 4            # Gmsh's types of elements
REGION = "far_field"                     # name of the tets
ALGORITHMS = (10, 1)                     # HXT, whose tets are better; Delaunay, if HXT fails

try:
    import gmsh
    import numpy as np
except (ImportError, OSError) as error:
    if os.path.exists(SYSTEM_PYTHON) and os.path.realpath(sys.executable) != os.path.realpath(SYSTEM_PYTHON):
        os.execv(SYSTEM_PYTHON, [SYSTEM_PYTHON, *sys.argv])
    print(f"SKIPPED: {error}; apt-get install python3-gmsh python3-numpy", file=sys.stderr)
    sys.exit(77)


class Refused(Exception):
    """The input cannot be used, or the space cannot be filled."""


def ask_gmsh(failure, function, *arguments):
    """Calls a function of Gmsh; its exceptions have no class of their own."""
    try:
        function(*arguments)
    except Exception as error:
        raise Refused(f"{failure}: {error}") from error


# ---------------------------------------------------------------------------------------------------------- the sheet


def read_sheet(path, name):
    """Returns the points and triangles of a group of faces, the names of all such groups, and the first free number."""
    if not os.path.exists(path):
        raise Refused(f"{path}: the file does not exist")
    gmsh.model.add("layers")
    ask_gmsh(f"{path}: Gmsh cannot read the file", gmsh.merge, path)
    groups = gmsh.model.getPhysicalGroups()
    of_faces = {gmsh.model.getPhysicalName(2, tag): tag for dimension, tag in groups if dimension == 2}
    if of_faces and name not in of_faces:
        raise Refused(f"{path}: no group of faces is called {name}; there are {', '.join(sorted(of_faces))}")
    surfaces = (gmsh.model.getEntitiesForPhysicalGroup(2, of_faces[name]) if of_faces
                else [tag for _, tag in gmsh.model.getEntities(2)])
    corners = []
    for surface in surfaces:
        for kind, nodes in zip(*gmsh.model.mesh.getElements(2, surface)[::2]):
            if kind != TRIANGLE:
                what = "quads" if kind == QUAD else "curved faces"
                raise Refused(f"{path}: the sheet has {what}, but tets stand on flat triangles only; convert the "
                              "surface to triangles first (subvol convert SURFACE -o SURFACE.stl)")
            corners.append(np.asarray(nodes, dtype=np.int64))
    if not corners:
        raise Refused(f"{path}: there are no triangles")
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    tags = np.asarray(tags, dtype=np.int64)
    place = np.full(tags.max() + 1, -1)
    place[tags] = np.arange(len(tags))
    used, triangles = np.unique(place[np.concatenate(corners)], return_inverse=True)
    points = np.array(coordinates).reshape(-1, 3)[used]
    gmsh.model.remove()
    return points, triangles.reshape(-1, 3), set(of_faces), 1 + max((tag for _, tag in groups), default=0)


def border_of(triangles):
    """Returns the edges of one triangle only, as rows of two points in the direction of the triangle."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    _, inverse, counts = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    if counts.max() > 2:
        raise Refused(f"the sheet has {np.sum(counts > 2)} edges of three triangles or more")
    return edges[counts[inverse.ravel()] == 1]


def parts_of(triangles):
    """Returns the triangles of each connected part."""
    label = np.arange(triangles.max() + 1)
    while True:
        least = label[triangles].min(axis=1)
        before = label.copy()
        np.minimum.at(label, triangles.ravel(), np.repeat(least, 3))
        label = label[label]
        if np.array_equal(label, before):
            return [triangles[label[triangles[:, 0]] == part] for part in np.unique(label[triangles])]


def loops_of(border):
    """Returns the border as closed loops of points."""
    following = dict(map(tuple, border))
    if len(following) != len(border):
        raise Refused("the border of the sheet touches itself at a point, or its triangles are inconsistently oriented")
    loops = []
    while following:
        first, point = following.popitem()
        loop = [first]
        while point != first:
            loop.append(point)
            if point not in following:
                raise Refused("the border of the sheet is not closed: its triangles are inconsistently oriented")
            point = following.pop(point)
        loops.append(loop)
    return loops


def face_of(points, loop, low, high):
    """Returns the face of the box in whose plane a loop of the border lies."""
    for axis in range(3):
        heights = points[loop, axis]
        for side, bound in enumerate((low, high)):
            if np.abs(heights - bound[axis]).max() <= FLATNESS * np.linalg.norm(high - low):
                return FACES[2 * axis + side]
    raise Refused("the sheet is open, and a loop of its border near (%g, %g, %g) does not lie in an outermost plane "
                  "perpendicular to an axis" % tuple(points[loop[0]]))


# ------------------------------------------------------------------------------------------------------------ the box


def make_box(points, holes, margin, box):
    """Returns the corners of the box: those given, or a margin around the sheet, but none beyond a plane of holes."""
    low, high = points.min(axis=0), points.max(axis=0)
    diagonal = np.linalg.norm(high - low)
    reach = margin / 100 * diagonal
    found = np.array(box).reshape(2, 3) if box else np.array([low - reach, high + reach])
    for k, face in enumerate(FACES):
        bound = (low, high)[k % 2][k // 2]
        if face in holes:
            if box and abs(found[k % 2, k // 2] - bound) > FLATNESS * diagonal:
                raise Refused(f"--box: the border of the sheet lies in the plane {face[0]} = {bound:g}, so the box "
                              "must end there")
            found[k % 2, k // 2] = bound
        elif (found[k % 2, k // 2] - bound) * (1 if k % 2 else -1) <= 0:
            raise Refused(f"the box must hold the sheet, which reaches to {face[0]} = {bound:g} at its face {face}")
    return found


def default_size(points, triangles, holes, box):
    """Returns the length of edges of the sheet's mean length that grow by GROWTH up to the nearest face of the box."""
    edges = np.linalg.norm(points[triangles] - points[np.roll(triangles, 1, axis=1)], axis=2)
    gaps = [abs(box[k % 2, k // 2] - (points.min(axis=0), points.max(axis=0))[k % 2][k // 2])
            for k, face in enumerate(FACES) if face not in holes]
    return edges.mean() + GROWTH * min(gaps)


def mesh_box(points, holes, box, size):
    """Makes triangles on the faces of the box; returns the points, those of the sheet first, and the triangles by face.

    holes  loops of points of the sheet by face; their edges become edges of triangles.
    """
    model = gmsh.model
    model.add("box")
    corner = {}
    for k in range(8):
        sides = [k >> axis & 1 for axis in range(3)]
        corner[tuple(sides)] = model.geo.addPoint(*(box[sides[axis], axis] for axis in range(3)), size)
    line = {}
    for a in corner:
        for axis in range(3):
            if not a[axis]:
                b = tuple(1 if k == axis else a[k] for k in range(3))
                line[a, b] = model.geo.addLine(corner[a], corner[b])
                line[b, a] = -line[a, b]
    of_sheet, surfaces = {}, {}
    for k, face in enumerate(FACES):
        axis, side = k // 2, k % 2
        at = lambda u, v: tuple({axis: side, (axis + 1) % 3: u, (axis + 2) % 3: v}[n] for n in range(3))
        ring = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)]
        loops = [model.geo.addCurveLoop([line[ring[n], ring[(n + 1) % 4]] for n in range(4)])]
        for hole in holes.get(face, []):
            place = []
            for n, p in enumerate(hole):
                position = np.array(points[p])
                position[axis] = box[side, axis]
                length = np.linalg.norm(points[hole[(n + 1) % len(hole)]] - points[p])
                place.append(model.geo.addPoint(*position, length))
                of_sheet[place[-1]] = p
            edges = [model.geo.addLine(place[n], place[(n + 1) % len(place)]) for n in range(len(place))]
            for edge in edges:
                model.geo.mesh.setTransfiniteCurve(edge, 2)
            loops.append(model.geo.addCurveLoop(edges))
        surfaces[face] = model.geo.addPlaneSurface(loops)
    model.geo.synchronize()
    ask_gmsh("Gmsh cannot mesh the faces of the box", model.mesh.generate, 2)
    tags, coordinates, _ = model.mesh.getNodes()
    tags = np.asarray(tags, dtype=np.int64)
    place = np.full(tags.max() + 1, -1)
    place[tags] = len(points) + np.arange(len(tags))
    for point, p in of_sheet.items():
        place[model.mesh.getNodes(0, point)[0]] = p
    triangles = {face: place[np.asarray(model.mesh.getElementsByType(TRIANGLE, tag)[1], dtype=np.int64)].reshape(-1, 3)
                 for face, tag in surfaces.items()}
    model.remove()
    return np.concatenate([points, np.array(coordinates).reshape(-1, 3)]), triangles


# ---------------------------------------------------------------------------------------------------------- the space


def fill(points, on_box, sheet, names, first_number):
    """Makes the model of tets between the sheet and the triangles of the box, with its groups; returns the tets."""
    model = gmsh.model
    model.add("far_field")
    surfaces = [*on_box.values(), *parts_of(sheet)]
    used, compact = np.unique(np.concatenate(surfaces), return_inverse=True)
    wanted = 1 + compact.reshape(-1, 3)
    tags = [model.addDiscreteEntity(2) for _ in surfaces]
    model.mesh.addNodes(2, tags[0], 1 + np.arange(len(used)), points[used].ravel())
    for tag, part in zip(tags, np.split(wanted, np.cumsum([len(part) for part in surfaces])[:-1])):
        model.mesh.addElementsByType(tag, TRIANGLE, [], part.ravel())
    volume = model.geo.addVolume([model.geo.addSurfaceLoop(tags)])
    model.geo.synchronize()
    cells = tets_between(volume, wanted)

    number = first_number
    for name in dict.fromkeys(names.values()):
        model.addPhysicalGroup(2, [tag for tag, face in zip(tags, on_box) if names[face] == name], number)
        model.setPhysicalName(2, number, name)
        number += 1
    model.addPhysicalGroup(3, [volume], number)
    model.setPhysicalName(3, number, REGION)
    return cells


def tets_between(volume, wanted):
    """Fills a volume with tets whose boundary is exactly the triangles that are wanted, or refuses it."""
    for algorithm in ALGORITHMS:
        gmsh.option.setNumber("Mesh.Algorithm3D", algorithm)
        gmsh.model.mesh.clear([(3, volume)])
        try:
            gmsh.model.mesh.generate(3)
        except Exception as error:
            why = str(error)
            continue
        cells = np.asarray(gmsh.model.mesh.getElementsByType(TET, volume)[1], dtype=np.int64).reshape(-1, 4)
        faces = np.sort(cells[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]].reshape(-1, 3), axis=1)
        found, counts = np.unique(faces, axis=0, return_counts=True)
        boundary = set(map(tuple, found[counts == 1].tolist()))
        missing = len(boundary ^ set(map(tuple, np.sort(wanted, axis=1).tolist())))
        if len(cells) and not missing:
            return cells
        why = f"{missing} triangles would not be on its boundary"
    raise Refused(f"Gmsh cannot fill the space ({why}): does the sheet intersect itself, or lie in a void of a part?")


def arguments_of(parser):
    """Returns the arguments, with `names`, the given names of faces by face."""
    parser.add_argument("layers", metavar="LAYERS.msh", help="file with the sheet")
    parser.add_argument("-o", "--output", metavar="FAR.msh", required=True, help="file to write")
    parser.add_argument("--sheet", metavar="NAME", default="outer", help="group of the triangles (default: outer)")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--margin", metavar="PERCENT", type=float, default=200,
                       help="distance from the sheet to the box, in percent of the sheet's diagonal (default: 200)")
    where.add_argument("--box", metavar=("X0", "Y0", "Z0", "X1", "Y1", "Z1"), nargs=6, type=float,
                       help="corners of the box")
    parser.add_argument("--size", metavar="LENGTH", type=float,
                        help="edge length on the box (default: the sheet's, and a quarter of the distance to the box)")
    parser.add_argument("--name", metavar="FACE=NAME", action="append", default=[],
                        help="group of a face of the box: x-, x+, y-, y+, z- or z+; may be given several times "
                             "(default: inlet for x-, outlet for x+, far for the others, but symmetry for faces in "
                             "which the sheet ends)")
    parser.add_argument("--force", action="store_true", help="replace a file that exists")
    arguments = parser.parse_args()
    arguments.names = dict(word.partition("=")[::2] for word in arguments.name)
    for face, name in arguments.names.items():
        if face not in FACES or not name:
            parser.error(f"--name {face}={name}: must be one of {', '.join(FACES)}, an equals sign and a name")
    if not arguments.margin > 0:
        parser.error("--margin must be positive")
    if arguments.size is not None and not arguments.size > 0:
        parser.error("--size must be positive")
    if not arguments.output.endswith(".msh"):
        parser.error(f"{arguments.output}: the extension must be .msh")
    if os.path.exists(arguments.output) and not arguments.force:
        parser.error(f"{arguments.output}: exists; give --force to replace it")
    return arguments


def make_far_field(arguments):
    """Writes the file; returns what to say about it."""
    points, sheet, taken, number = read_sheet(arguments.layers, arguments.sheet)
    low, high, holes = points.min(axis=0), points.max(axis=0), {}
    for loop in loops_of(border_of(sheet)):
        holes.setdefault(face_of(points, loop, low, high), []).append(loop)
    names = {face: arguments.names.get(face, SYMMETRY if face in holes else NAMES.get(face, FAR)) for face in FACES}
    for face, name in names.items():
        if name in taken:
            raise Refused(f"{arguments.layers} has a group {name} already; give --name {face}=NAME for the box's face "
                          f"{face}")
    box = make_box(points, holes, arguments.margin, arguments.box)
    size = arguments.size or default_size(points, sheet, holes, box)
    cells = fill(*mesh_box(points, holes, box, size), sheet, names, number)
    ask_gmsh(f"{arguments.output}: Gmsh cannot write the file", gmsh.write, arguments.output)
    corners = " to ".join("(%g, %g, %g)" % tuple(corner) for corner in box)
    return f"{len(cells)} tets around {len(sheet)} triangles, in a box from {corners} with edges of {size:g} there"


def main():
    arguments = arguments_of(argparse.ArgumentParser(
        description="Fills the space between a sheet of triangles and a box around it with tets, by means of Gmsh."))
    gmsh.initialize([], False)  # without the user's options
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.Binary", 1)  # positions keep all of their bits
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1)  # sizes change linearly from the sheet to the box
    try:
        print(make_far_field(arguments))
    except Refused as error:
        print(f"far_field.py: {error}", file=sys.stderr)
        return 1
    finally:
        gmsh.finalize()
    return 0


if __name__ == "__main__":
    sys.exit(main())
