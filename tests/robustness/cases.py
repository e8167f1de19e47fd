# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs of the program that the scripts beside this one share, on the project's own samples."""
import json
import os
import pathlib
import subprocess

# What a report says of how a run went, not of what it came to: times, memory, words of the command line, and whether it
# was resumed. Everything else in it is compared, and every other file byte by byte.
VOLATILE = {"seconds", "peak_memory_bytes", "command_line", "resumed_from", "recalled_stages"}
VOLATILE_OPTIONS = {"threads", "checkpoint", "every", "resume", "force", "quiet"}

# Name, words of the command line, outputs. {s} is the folder of samples; the first three are quick.
CASES = [
    ("fit", "fit {s}/ball_target.off --template {s}/ball_template.mesh --levels 2 --max-iterations 4",
     ["out.mesh", "out.glb", "cage:cage.mesh", "cage:cage.usda", "out.obj"]),
    ("order", "fit {s}/ball_target.off --template {s}/ball_template.mesh --order 2 --max-iterations 4",
     ["out.vtu", "out.glb", "out.msh"]),
    ("shell", "shell {s}/bowl.obj --thickness 2% --layers 2 --side both", ["out.mesh", "out.vtu", "out.glb"]),
    ("cage-only", "fit {s}/torus_target.off --template {s}/torus_template.mesh --levels 2 --cage-only",
     ["out.vtk", "cage:cage.obj", "out.gltf"]),
    ("creases", "fit {s}/bracket_target.off --template {s}/bracket_template.mesh --levels 2 --crease-angle 40",
     ["out.msh", "cage:cage.mesh"]),
    ("lbfgs", "fit {s}/ball_target.off --template {s}/ball_template.mesh --levels 1 --solver lbfgs"
              " --correspondence voronoi", ["out.mesh"]),
    ("adaptive", "fit {s}/torus_target.off --template {s}/torus_template.mesh --order 4 --adaptive --basis legendre"
                 " --tolerance 0.1", ["out.vtu"]),
    ("optimize", "optimize {s}/tets.mesh --crease-angle 30", ["out.mesh", "out.vtu"]),
    ("curve", "optimize {s}/bracket_template.mesh --order 2 --target {s}/bracket_target.off", ["out.vtu", "out.obj"]),
    ("curved-shell", "shell {s}/bowl.obj --thickness 2% --order 2", ["out.vtu"]),
    ("template", "template auto {s}/ball_target.off --cells 60", ["out.mesh", "out.usda"]),
    ("template-made", "fit {s}/ball_target.off --cells 480 --levels 1", ["out.mesh"]),
    ("automatic", "fit {s}/ball_target.off --cells 800", ["out.mesh"]),
]


def file_name(output):
    return output.removeprefix("cage:")


def environment():
    """Runs are short and side by side with others: one thread, if nothing else is asked for, and none that spins."""
    return {"OMP_NUM_THREADS": "1", **os.environ, "OMP_WAIT_POLICY": "passive"}


def make_samples(program, sample_program, folder):
    """Writes the samples, and a ball of tets that are worth improving."""
    subprocess.run([sample_program, folder], check=True)
    subprocess.run([program, "template", "split", folder / "ball_template.mesh", "--into", "tets", "-o",
                    folder / "tets.mesh", "--quiet", "--force"], check=True, env=environment())


def command(program, case, samples, extra=()):
    """The words of a case whose outputs go to the folder it is started in."""
    _, words, outputs = case
    result = [str(program), *words.format(s=samples).split(), "--report", "report.json", "--force", "--quiet"]
    for output in outputs:
        result += ["-o", output]
    return result + [str(word) for word in extra]


def file_names(case):
    return [file_name(output) for output in case[2]] + ["report.json"]


def stable_report(text):
    """A report without what may differ between two runs that came to the same."""
    def strip(value):
        if isinstance(value, dict):
            return {key: strip(item) for key, item in value.items() if key not in VOLATILE}
        return [strip(item) for item in value] if isinstance(value, list) else value
    report = strip(json.loads(text))
    for name in VOLATILE_OPTIONS:
        report.get("options", {}).pop(name, None)
    return json.dumps(report, sort_keys=True).encode()


def content(path):
    """What is compared of a file; None where it is not there."""
    path = pathlib.Path(path)
    if not path.exists():
        return None
    data = path.read_bytes()
    return stable_report(data) if path.name == "report.json" and data.startswith(b"{") else data
