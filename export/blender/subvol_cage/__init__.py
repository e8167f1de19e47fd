# SPDX-License-Identifier: GPL-3.0-or-later
"""Control cages of subdivision volumes and scenes in Blender; fits and shells of the active mesh."""

bl_info = {
    "name": "subvol: control cages, fits, shells",
    "author": "subvol",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "File > Import > subvol cage, subvol scene; Object > subvol",
    "description": "Imports control cages with creases below their limit surface, and scenes; runs subvol fit and subvol shell",
    "category": "Mesh",
}

import bpy
from bpy.props import StringProperty

from . import cage_object, runs, scene_import


class Preferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    program: StringProperty(name="Program", description="Path of subvol; empty: found by its name", subtype="FILE_PATH")

    def draw(self, context):
        self.layout.prop(self, "program")


class Menu(bpy.types.Menu):
    bl_idname = "OBJECT_MT_subvol"
    bl_label = "subvol"

    def draw(self, context):
        for operator in (runs.Fit, runs.Shell):
            self.layout.operator_context = "INVOKE_DEFAULT"
            self.layout.operator(operator.bl_idname)


def import_entry(self, context):
    self.layout.operator(cage_object.ImportCage.bl_idname, text="subvol cage (.mesh)")
    self.layout.operator(scene_import.ImportScene.bl_idname, text="subvol scene (.glb)")


def menu_entry(self, context):
    self.layout.menu(Menu.bl_idname)


CLASSES = (Preferences, cage_object.ImportCage, scene_import.ImportScene, runs.Fit, runs.Shell, Menu)


def register():
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.TOPBAR_MT_file_import.append(import_entry)
    bpy.types.VIEW3D_MT_object.append(menu_entry)


def unregister():
    bpy.types.VIEW3D_MT_object.remove(menu_entry)
    bpy.types.TOPBAR_MT_file_import.remove(import_entry)
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
