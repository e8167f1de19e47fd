# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by Blender (test_blender.py): imports cages, saves what the modifier makes of them, runs the operators.

arguments after "--": the add-on as a .zip, the program, then cages; the points of CAGE.mesh go to CAGE.npy.
"""

import sys

import numpy

import addon_utils
import bpy

archive, program, *cages = sys.argv[sys.argv.index("--") + 1 :]
bpy.ops.preferences.addon_install(filepath=archive)
bpy.ops.preferences.addon_enable(module="subvol_cage")
bpy.context.preferences.addons["subvol_cage"].preferences.program = program


def shown():
    thing = bpy.context.object
    mesh = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    return numpy.array([vertex.co[:] for vertex in mesh.vertices])


for cage in cages:
    assert bpy.ops.import_mesh.subvol_cage(filepath=cage, levels=3) == {"FINISHED"}, cage
    assert all(len(polygon.vertices) in (3, 4) for polygon in bpy.context.object.data.polygons)
    modifier = bpy.context.object.modifiers[0]
    assert modifier.type == "SUBSURF" and modifier.use_limit_surface
    numpy.save(cage.replace(".mesh", ".npy"), shown())

bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, location=(4, 0, 0))
assert bpy.ops.object.subvol_fit(levels=1, cells=30) == {"FINISHED"}
cage = bpy.context.object
assert cage.name.endswith("fit") and cage.location.x == 4
radii = numpy.linalg.norm(shown(), axis=1)
assert abs(radii - 1).max() < 0.05, radii

bpy.ops.mesh.primitive_grid_add(x_subdivisions=4, y_subdivisions=4)
assert bpy.ops.object.subvol_shell(thickness=3, layers=2) == {"FINISHED"}
assert len(bpy.context.object.data.polygons) == 2 * 16 + 2 * 16

try:
    bpy.ops.import_mesh.subvol_cage(filepath=__file__)
    assert False, "not refused"
except RuntimeError as error:
    assert "no control cage" in str(error), error
