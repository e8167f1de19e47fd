# SPDX-License-Identifier: GPL-3.0-or-later
"""Cages as objects: quads with creases and corners below a Subdivision Surface modifier on the limit surface."""

import collections
import math
import os

import bmesh
import bpy
from bpy.props import IntProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from .medit import INFINITE, CageError, read_cage


def weight_of(sharpness):
    """Blender's crease, 0 .. 1, for a sharpness in refinements: it takes 10 crease^2 for it."""
    return min(1.0, math.sqrt(sharpness / INFINITE))


def has_approximated_features(cage):
    """Half-sharp features and ends of creases: around them Blender is only as exact as it refines."""
    ends = collections.Counter(point for edge in cage.creases for point in edge)
    half_sharp = any(s < INFINITE for s in (*cage.creases.values(), *cage.corners.values()))
    return half_sharp or 1 in ends.values()


def crease_layer(items, name):
    """Blender 4 keeps creases in named attributes, 3 in a layer of their own."""
    layers = items.layers
    return layers.crease.verify() if hasattr(layers, "crease") else layers.float.new(name)


def cage_mesh(name, cage):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(cage.points, [], cage.faces)
    edit = bmesh.new()
    edit.from_mesh(mesh)
    edge_layer, vertex_layer = crease_layer(edit.edges, "crease_edge"), crease_layer(edit.verts, "crease_vert")
    edit.verts.ensure_lookup_table()
    for (a, b), sharpness in cage.creases.items():
        edge = edit.edges.get((edit.verts[a], edit.verts[b]))
        if edge is not None:
            edge[edge_layer] = weight_of(sharpness)
    for vertex, sharpness in cage.corners.items():
        edit.verts[vertex][vertex_layer] = weight_of(sharpness)
    edit.to_mesh(mesh)
    edit.free()
    for polygon in mesh.polygons:
        polygon.use_smooth = True
    mesh.update()
    return mesh


def add_cage(context, path, name, levels, matrix=None):
    """The cage in a file as a new active object."""
    cage = read_cage(path)
    thing = bpy.data.objects.new(name, cage_mesh(name, cage))
    if matrix is not None:
        thing.matrix_world = matrix
    context.collection.objects.link(thing)
    modifier = thing.modifiers.new("Limit surface", "SUBSURF")
    modifier.levels = modifier.render_levels = levels
    modifier.use_limit_surface = True
    modifier.use_creases = True
    modifier.quality = 10 if has_approximated_features(cage) else 3
    for other in context.selected_objects:
        other.select_set(False)
    thing.select_set(True)
    context.view_layer.objects.active = thing
    return thing


class ImportCage(bpy.types.Operator, ImportHelper):
    """Import the control cage of a subdivision volume, its creases and its limit surface"""

    bl_idname = "import_mesh.subvol_cage"
    bl_label = "Import subvol cage"
    bl_options = {"REGISTER", "UNDO"}

    filename_ext = ".mesh"
    filter_glob: StringProperty(default="*.mesh", options={"HIDDEN"})
    levels: IntProperty(name="Levels", description="Subdivisions shown", default=2, min=0, max=6)

    def execute(self, context):
        name = os.path.splitext(os.path.basename(self.filepath))[0]
        try:
            add_cage(context, self.filepath, name, self.levels)
        except (CageError, OSError, UnicodeDecodeError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}
