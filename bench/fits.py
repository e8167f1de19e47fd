#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures whole runs of `subvol fit`, of one program or of two beside each other.

    fits.py cases PROGRAM [OTHER] --data FOLDER [--case NAME ...] [--levels L] [--threads N ...] [--runs R] [-- OPTION ...]
    fits.py scaling PROGRAM [OTHER] --target FILE.off --template FILE [--refinements K] [--levels L ...] [--runs R]
                    [--plot FILE.svg] [-- OPTION ...]

`cases` fits a fixed list of targets with their templates; FOLDER/NAME holds target.off and template.mesh. `scaling`
splits the triangles of a target K times at their midpoints, which leaves the surface as it is, and fits each of these
targets; with several levels it shows what cells cost as well. Options after `--` go to the fits.

Programs take turns, and of R runs the one that took the least CPU time counts. The tables are Markdown: CPU seconds
and seconds by the clock of the whole program, Newton steps, seconds by phase as the report has them, distances in
percent of the diagonal and the least scaled Jacobian.
"""
import argparse
import json
import math
import os
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile
import time

CASES = ("bone87", "hanger139", "joint129", "sculpture51", "doubletorus17", "rod59", "bust7", "hand261", "cad_cube17",
         "cad_fandisk49", "block_near100")
PHASES = ("read", "solve", "quality", "distance", "levels", "check", "write")


def fit(program, target, template, levels, threads, options):
    """Runs one fit and returns its figures."""
    with tempfile.TemporaryDirectory() as folder:
        report = pathlib.Path(folder) / "report.json"
        words = [program, "fit", target, "--template", template, "--levels", levels, "-o", f"{folder}/out.mesh",
                 "--report", report, "--quiet", *options]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        begin = time.monotonic()
        run = subprocess.run([str(word) for word in words], capture_output=True, text=True,
                             env=os.environ | {"OMP_NUM_THREADS": str(threads)})
        wall = time.monotonic() - begin
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if not report.exists():
            sys.exit(f"{' '.join(map(str, words))}\nended with {run.returncode} and no report: {run.stderr.strip()}")
        told = json.loads(report.read_text())
    kept = [stage for stage in told["stages"] if stage.get("kept")]
    return {
        "cpu": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
        "wall": wall,
        "steps": sum(stage["iterations"] for stage in kept),
        "cells": told["quality"]["cells"],
        "triangles": told["input"]["target"].get("triangles", 0),
        "mean": told["distance"]["mean_percent"],
        "max": told["distance"]["max_percent"],
        "jacobian": told["quality"]["min_scaled_jacobian"],
        "seconds": told["seconds"],
    }


def measure(programs, runs, *settings):
    """Returns the figures of each program: those of the run that took the least CPU time."""
    figures = [None] * len(programs)
    for _ in range(runs):
        for i, program in enumerate(programs):
            now = fit(program, *settings)
            if not figures[i] or now["cpu"] < figures[i]["cpu"]:
                figures[i] = now
    return figures


def row(*cells):
    print("| " + " | ".join(str(cell) for cell in cells) + " |", flush=True)


def header(*names):
    row(*names)
    row(*("---" for _ in names))


def pair(figures, form):
    """Returns the figure of the first program and, in brackets, that of the other."""
    texts = [form(f) for f in figures]
    return texts[0] if len(texts) == 1 or texts[0] == texts[1] else f"{texts[0]} ({texts[1]})"


def describe(f):
    phases = " ".join(f"{f['seconds'].get(name, 0):.1f}" for name in PHASES)
    return phases, f"{f['mean']:.4f} / {f['max']:.3f}", f"{f['jacobian']:.3f}"


def run_cases(arguments, programs):
    threads = arguments.threads or [1]
    header("case", "cells", *(f"CPU s / s, {n} thread{'s' * (n > 1)}" for n in threads), "steps",
           "s: " + ", ".join(PHASES), "mean / largest %", "least SJ", *(["ratio"] if len(programs) > 1 else []))
    ratios = []
    for name in arguments.case or CASES:
        folder = arguments.data / name
        all_figures = [measure(programs, arguments.runs, folder / "target.off", folder / "template.mesh",
                               arguments.levels, n, arguments.options) for n in threads]
        figures = all_figures[0]
        cells = [name, pair(figures, lambda f: str(f["cells"]))]
        cells += [pair(of_threads, lambda f: f"{f['cpu']:.1f} / {f['wall']:.1f}") for of_threads in all_figures]
        cells.append(pair(figures, lambda f: str(f["steps"])))
        cells += [pair(figures, lambda f, i=i: describe(f)[i]) for i in range(3)]
        if len(programs) > 1:
            ratios.append(figures[1]["cpu"] / figures[0]["cpu"])
            cells.append(f"{ratios[-1]:.2f}")
        row(*cells)
    if ratios:
        print(f"\nCPU time of the other program by that of the first: median {statistics.median(ratios):.2f}, "
              f"{min(ratios):.2f} to {max(ratios):.2f}")


def split(path, result):
    """Writes the surface with each triangle split into four."""
    import numpy
    words = path.read_text().split()
    num_vertices, num_faces = int(words[1]), int(words[2])
    points = numpy.array(words[4:4 + 3 * num_vertices], float).reshape(-1, 3)
    faces = numpy.array(words[4 + 3 * num_vertices:4 + 3 * num_vertices + 4 * num_faces], int).reshape(-1, 4)
    if words[0] != "OFF" or not (faces[:, 0] == 3).all():
        sys.exit(f"{path}: expected an OFF file of triangles")
    a, b, c = faces[:, 1:].T
    ends = numpy.sort(numpy.stack([numpy.concatenate([a, b, c]), numpy.concatenate([b, c, a])], 1), 1)
    edges, number = numpy.unique(ends, axis=0, return_inverse=True)
    ab, bc, ca = number.reshape(3, -1) + num_vertices
    points = numpy.concatenate([points, points[edges].mean(1)])
    parts = numpy.concatenate([numpy.stack(corners, 1) for corners in ((a, ab, ca), (ab, b, bc), (ca, bc, c),
                                                                       (ab, bc, ca))])
    with open(result, "w", encoding="ascii") as file:
        file.write(f"OFF\n{len(points)} {len(parts)} 0\n")
        numpy.savetxt(file, points, "%.9g")
        numpy.savetxt(file, numpy.insert(parts, 0, 3, axis=1), "%d")


def plot(path, lines):
    """Writes a diagram of CPU seconds against triangles, both logarithmic. `lines`: points by the name of a line."""
    width, height, margin = 720, 480, 60
    points = [point for line in lines.values() for point in line]
    spans = []
    for values in zip(*points):
        low, high = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
        spans.append((low, max(high, low + 1)))

    def at(point):
        shares = [(math.log10(value) - low) / (high - low) for value, (low, high) in zip(point, spans)]
        return margin + shares[0] * (width - 2 * margin), height - margin - shares[1] * (height - 2 * margin)

    (left, bottom), (right, top) = at([10 ** s[0] for s in spans]), at([10 ** s[1] for s in spans])
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" '
             'font-size="13">', f'<rect width="{width}" height="{height}" fill="white"/>']
    for k in range(spans[0][0], spans[0][1] + 1):
        x = at((10 ** k, 10 ** spans[1][0]))[0]
        parts.append(f'<path d="M{x:.1f} {bottom:.1f}V{top:.1f}" stroke="#ccc"/>'
                     f'<text x="{x:.1f}" y="{bottom + 18:.1f}" text-anchor="middle">{10 ** k:,} triangles</text>')
    for k in range(spans[1][0], spans[1][1] + 1):
        y = at((10 ** spans[0][0], 10 ** k))[1]
        parts.append(f'<path d="M{left:.1f} {y:.1f}H{right:.1f}" stroke="#ccc"/>'
                     f'<text x="{left - 6:.1f}" y="{y + 4:.1f}" text-anchor="end">{10.0 ** k:g} s</text>')
    for i, (name, line) in enumerate(lines.items()):
        color = ("#1764ab", "#c8511b", "#2a7d3f", "#7b4aa5", "#555555", "#a5762a")[i % 6]
        path_data = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in map(at, line))
        x, y = at(line[-1])
        parts.append(f'<path d="{path_data}" fill="none" stroke="{color}" stroke-width="2"/>'
                     f'<text x="{x:.1f}" y="{y - 6:.1f}" text-anchor="end" fill="{color}">{name}</text>')
    path.write_text("\n".join(parts) + "\n</svg>\n")


def run_scaling(arguments, programs):
    header("triangles", "level", "cells", "CPU s / s", "CPU s but for reading and the check",
           "s: " + ", ".join(PHASES), "mean / largest %", "least SJ")
    lines = {}
    with tempfile.TemporaryDirectory() as folder:
        target = arguments.target
        for k in range(arguments.refinements + 1):
            if k > 0:
                finer = pathlib.Path(folder) / f"target{k}.off"
                split(target, finer)
                target = finer
            for level in arguments.levels:
                figures = measure(programs, arguments.runs, target, arguments.template, level, 1, arguments.options)

                def rest(f):
                    return f["cpu"] - f["seconds"]["read"] - f["seconds"]["check"]

                row(f"{figures[0]['triangles']:,}", level, pair(figures, lambda f: str(f["cells"])),
                    pair(figures, lambda f: f"{f['cpu']:.1f} / {f['wall']:.1f}"),
                    pair(figures, lambda f: f"{rest(f):.1f}"),
                    *(pair(figures, lambda f, i=i: describe(f)[i]) for i in range(3)))
                for program, f in zip(programs, figures):
                    other = " (other)" * (program != programs[0])
                    lines.setdefault(f"level {level}, {f['cells']:,} cells{other}", []).append((f["triangles"], f["cpu"]))
    if arguments.plot:
        plot(arguments.plot, lines)


def main():
    parser = argparse.ArgumentParser(usage=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    for name in ("cases", "scaling"):
        verb = verbs.add_parser(name, usage=__doc__)
        verb.add_argument("program", type=pathlib.Path)
        verb.add_argument("other", type=pathlib.Path, nargs="?")
        verb.add_argument("--runs", type=int, default=1)
        if name == "cases":
            verb.add_argument("--levels", type=int, default=3)
            verb.add_argument("--data", type=pathlib.Path, required=True)
            verb.add_argument("--case", nargs="+")
            verb.add_argument("--threads", type=int, nargs="+")
        else:
            verb.add_argument("--levels", type=int, nargs="+", default=[2])
            verb.add_argument("--target", type=pathlib.Path, required=True)
            verb.add_argument("--template", type=pathlib.Path, required=True)
            verb.add_argument("--refinements", type=int, default=3)
            verb.add_argument("--plot", type=pathlib.Path)
    words = sys.argv[1:]
    end = words.index("--") if "--" in words else len(words)
    arguments = parser.parse_args(words[:end])
    arguments.options = words[end + 1:]
    programs = [path.resolve() for path in (arguments.program, arguments.other) if path]
    (run_cases if arguments.verb == "cases" else run_scaling)(arguments, programs)


if __name__ == "__main__":
    main()
