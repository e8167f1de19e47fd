# SPDX-License-Identifier: GPL-3.0-or-later
"""`subvol fit` and `subvol shell` on the active mesh, in the background and with progress."""

import json
import os
import queue
import shutil
import signal
import subprocess
import tempfile
import threading

import bpy
from bpy.props import EnumProperty, FloatProperty, IntProperty

from .cage_object import add_cage
from .medit import CageError

# What the program's exit status means: the result is there, good or the best so far.
WITH_RESULT = {0: "", 1: "the result is not valid everywhere", 4: "not converged; best result so far",
               130: "interrupted; best result so far"}


def program(context):
    return context.preferences.addons[__package__].preferences.program or "subvol"


def write_off(path, context, thing):
    """The object's mesh with its modifiers, in its own coordinates."""
    evaluated = thing.evaluated_get(context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    with open(path, "w") as file:
        file.write(f"OFF\n{len(mesh.vertices)} {len(mesh.polygons)} 0\n")
        file.writelines("%.17g %.17g %.17g\n" % tuple(v.co) for v in mesh.vertices)
        file.writelines(f"{len(p.vertices)} {' '.join(map(str, p.vertices))}\n" for p in mesh.polygons)
    evaluated.to_mesh_clear()


class Run:
    """The program at work in a folder of its own; its progress arrives in a queue."""

    def __init__(self, words, folder):
        self.folder = folder
        self.fractions = queue.Queue()
        self.errors = open(os.path.join(folder, "errors.txt"), "w+")
        self.process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=self.errors, text=True)
        self.thread = threading.Thread(target=self.listen, daemon=True)
        self.thread.start()

    def listen(self):
        for line in self.process.stdout:
            try:
                self.fractions.put(json.loads(line)["fraction"])
            except (ValueError, KeyError, TypeError):
                pass

    def interrupt(self):
        self.process.send_signal(signal.SIGINT)

    def close(self):
        """Exit status and what was said."""
        status = self.process.wait()
        self.thread.join()
        self.errors.seek(0)
        said = self.errors.read().strip()
        self.errors.close()
        return status, said


class RunOperator:
    """What both operators share. `words` gives the verb and its options."""

    bl_options = {"REGISTER", "UNDO"}
    run = timer = None

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type == "MESH" and context.mode == "OBJECT"

    def start(self, context):
        self.source = context.object
        self.folder = tempfile.mkdtemp(prefix="subvol-")
        surface, self.result = (os.path.join(self.folder, name) for name in ("surface.off", "cage.mesh"))
        write_off(surface, context, self.source)
        verb, *options = self.words()
        try:
            self.run = Run([program(context), verb, surface, *options, "-o", f"cage:{self.result}", "--quiet",
                            "--progress", "json"], self.folder)
        except OSError as error:
            self.report({"ERROR"}, f"{program(context)} cannot be started ({error}); see the add-on's preferences")
            shutil.rmtree(self.folder)
            return False
        return True

    def end(self, context):
        status, said = self.run.close()
        try:
            if status not in WITH_RESULT or not os.path.exists(self.result):
                self.report({"ERROR"}, said or f"subvol ended with status {status} and no result")
                return {"CANCELLED"}
            add_cage(context, self.result, f"{self.source.name} {self.kind}", 2, self.source.matrix_world.copy())
        except CageError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            shutil.rmtree(self.folder)
        if WITH_RESULT[status]:
            self.report({"WARNING"}, WITH_RESULT[status])
        return {"FINISHED"}

    def execute(self, context):
        return self.end(context) if self.start(context) else {"CANCELLED"}

    def invoke(self, context, event):
        if not self.start(context):
            return {"CANCELLED"}
        context.window_manager.progress_begin(0, 1)
        self.timer = context.window_manager.event_timer_add(0.2, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            self.run.interrupt()
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        while not self.run.fractions.empty():
            fraction = self.run.fractions.get()
            context.window_manager.progress_update(fraction)
            context.workspace.status_text_set(f"subvol {self.kind}: {fraction:.0%}   (Esc: the best result so far)")
        if self.run.process.poll() is None:
            return {"RUNNING_MODAL"}
        context.window_manager.event_timer_remove(self.timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)
        return self.end(context)


class Fit(RunOperator, bpy.types.Operator):
    """Fit a subdivision volume to the active mesh, a closed surface, and add its control cage"""

    bl_idname = "object.subvol_fit"
    bl_label = "Fit subdivision volume"
    kind = "fit"

    levels: IntProperty(name="Levels", description="Times the template is subdivided", default=2, min=1, max=6)
    cells: IntProperty(name="Cells", description="About so many cells; 0: as many as it needs", default=0, min=0)

    def words(self):
        return ["fit", "--levels", str(self.levels)] + (["--cells", str(self.cells)] if self.cells else [])


class Shell(RunOperator, bpy.types.Operator):
    """Grow layers of cells on the active mesh and add them as a control cage"""

    bl_idname = "object.subvol_shell"
    bl_label = "Grow shell"
    kind = "shell"

    thickness: FloatProperty(name="Thickness", description="Per cent of the box's diagonal", default=2, min=1e-3)
    layers: IntProperty(name="Layers", default=1, min=1, max=1000)
    side: EnumProperty(name="Side", items=[(s, s.capitalize(), "") for s in ("outward", "inward", "both")])

    def words(self):
        return ["shell", "--thickness", f"{self.thickness}%", "--layers", str(self.layers), "--side", self.side]
