# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of subvol (.glb, .gltf): Blender's own importer, also where it does not fit the NumPy that is installed."""

import contextlib

import bpy
import numpy
from bpy.props import StringProperty
from bpy_extras.io_utils import ImportHelper


@contextlib.contextmanager
def names_of_old_numpy():
    """Blender 3.4 asks for numpy.bool, which NumPy no longer has from 1.24 on. Debian 12 has these two."""
    is_missing = not hasattr(numpy, "bool")
    if is_missing:
        numpy.bool = bool
    try:
        yield
    finally:
        if is_missing:
            del numpy.bool


class ImportScene(bpy.types.Operator, ImportHelper):
    """Import a surface, a cutaway or the course of a fit that subvol has written"""

    bl_idname = "import_scene.subvol"
    bl_label = "Import subvol scene"
    bl_options = {"REGISTER", "UNDO"}

    filename_ext = ".glb"
    filter_glob: StringProperty(default="*.glb;*.gltf", options={"HIDDEN"})

    def execute(self, context):
        try:
            with names_of_old_numpy():
                return bpy.ops.import_scene.gltf(filepath=self.filepath)
        except (RuntimeError, AttributeError) as error:  # the second one if the importer is switched off
            self.report({"ERROR"}, str(error).strip())
            return {"CANCELLED"}
