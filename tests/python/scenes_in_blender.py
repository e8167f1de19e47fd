# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by Blender (test_blender.py): imports .glb files and tells what is there.

arguments after "--": a .json to write, the add-on as a .zip, then .glb files; the .json has one entry for each, by the
file's name.
"""

import json
import os
import sys

import bpy

answer, archive, *files = sys.argv[sys.argv.index("--") + 1 :]


def facts(thing):
    mesh = thing.data
    extras = {key: value.to_dict() if hasattr(value, "to_dict") else value for key, value in thing.items()}
    found = {"parent": thing.parent.name if thing.parent else None, "extras": extras}
    if mesh is None:
        return found
    world = [thing.matrix_world @ vertex.co for vertex in mesh.vertices]
    found.update(vertices=len(mesh.vertices), edges=len(mesh.edges), faces=len(mesh.polygons),
                 low=[min(p[k] for p in world) for k in range(3)], high=[max(p[k] for p in world) for k in range(3)],
                 colors=[layer.name for layer in mesh.color_attributes], attributes=[a.name for a in mesh.attributes],
                 shapes=[key.name for key in mesh.shape_keys.key_blocks] if mesh.shape_keys else [])
    if mesh.polygons:
        corners = [set(polygon.vertices) for polygon in mesh.polygons]
        found["pairs"] = sum(len(a & b) == 2 for a, b in zip(corners[::2], corners[1::2]))
        bpy.context.view_layer.objects.active = thing
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.mesh.tris_convert_to_quads()
        bpy.ops.object.mode_set(mode="OBJECT")
        found["faces_after_tris_to_quads"] = len(mesh.polygons)
    return found


bpy.ops.preferences.addon_install(filepath=archive)
told = {}
for file in files:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="subvol_cage")
    assert bpy.ops.import_scene.subvol(filepath=file) == {"FINISHED"}, file
    told[os.path.basename(file)] = {
        "things": {thing.name: facts(thing) for thing in list(bpy.data.objects)},
        "actions": [action.name for action in bpy.data.actions]}
with open(answer, "w") as out:
    json.dump(told, out)
