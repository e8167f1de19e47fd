#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sends SIGINT or SIGTERM to every verb at a random moment, and measures how long it takes to end.

Usage: tests/robustness/answer_signals.py PROGRAM [--runs N] [--seed S] [--limit SECONDS] [--longest SECONDS] [NAME ...]

The inputs are large enough that most verbs take many seconds: a ball of 300,000 triangles, a thin plate whose template
needs grids of millions of cells, and 200,000 hexes. Each run gets one signal, after a delay that is drawn evenly on a
logarithmic scale from 0.1 s to --longest. A run that ends before its signal counts for nothing. Afterward no file may be
half-written: nothing but whole outputs may be left. Prints one line for each run, and the slowest answer of each case.

Exit status: 0 all runs ended within the limit, 1 some did not or left something, 77 nothing could be measured.
"""
import argparse
import math
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time

# Name, words. {i} is the folder of inputs.
CASES = [
    ("fit", "fit {i}/ball.off --cells 60000 -o a.mesh -o a.glb --report a.json"),
    ("fit-plate", "fit {i}/plate.off --cells 50000 -o a.mesh"),
    ("fit-levels", "fit {i}/ball.off --levels 3 --cells 600 -o a.mesh -o a.glb -o cage:c.mesh"),
    ("fit-template", "fit {i}/ball.off --template {i}/block.mesh --levels 1 -o a.mesh"),
    ("fit-order", "fit {i}/ball.off --cells 300 --order 4 -o a.vtu -o a.glb"),
    ("optimize", "optimize {i}/block.mesh -o a.mesh -o a.vtu"),
    ("optimize-target", "optimize {i}/block.mesh --target {i}/ball.off -o a.mesh"),
    ("shell", "shell {i}/ball.off --thickness 1% --layers 3 -o a.vtu -o a.glb"),
    ("shell-curved", "shell {i}/ball.off --thickness 1% --order 2 -o a.vtu"),
    ("template-auto", "template auto {i}/plate.off --cells 100000 -o a.mesh"),
    ("template-ball", "template auto {i}/ball.off --cells 50000 -o a.mesh"),
    ("template-split", "template split {i}/block.mesh --into tets -o a.mesh"),
    ("template-pillow", "template pillow {i}/block.mesh -o a.mesh"),
    ("template-grid", "template grid --box 0 0 0 1 1 1 --counts 120 120 120 -o a.mesh"),
    ("subdivide", "subdivide {i}/block.mesh --levels 1 -o a.mesh"),
    ("check", "check {i}/block.mesh --target {i}/ball.off"),
    ("check-surface", "check {i}/ball.off"),
    ("convert", "convert {i}/block.mesh -o a.vtu -o a.msh -o a.glb"),
    ("convert-surface", "convert {i}/ball.off -o a.obj -o a.glb"),
    ("view", "view {i}/block.mesh -o a.html"),
]


def write_ball(path, n):
    """A sphere around (1, 1, 1) from a cube of n x n squares on each side, in triangles."""
    numbers, points, triangles = {}, [], []

    def vertex(at):
        if at not in numbers:
            numbers[at] = len(points)
            p = [2 * c / n - 1 for c in at]
            length = math.sqrt(sum(c * c for c in p))
            points.append([1 + c / length for c in p])
        return numbers[at]

    for side in range(6):
        for i in range(n):
            for j in range(n):
                def corner(di, dj):
                    at = [0, 0, 0]
                    at[side % 3] = n if side < 3 else 0
                    at[(side + 1) % 3], at[(side + 2) % 3] = i + di, j + dj
                    return vertex(tuple(at))
                a, b, c, d = corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)
                triangles += [(a, b, c), (a, c, d)] if side < 3 else [(a, c, b), (a, d, c)]
    with open(path, "w") as file:
        file.write(f"OFF\n{len(points)} {len(triangles)} 0\n")
        file.writelines("%.9g %.9g %.9g\n" % tuple(p) for p in points)
        file.writelines("3 %d %d %d\n" % t for t in triangles)


def write_plate(path):
    corners = [(x, y, z) for z in (0, 0.002) for y in (0, 1) for x in (0, 1)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    with open(path, "w") as file:
        file.write("OFF\n8 12 0\n")
        file.writelines("%g %g %g\n" % c for c in corners)
        for a, b, c, d in quads:
            file.write(f"3 {a} {b} {c}\n3 {a} {c} {d}\n")


def make_inputs(program, folder):
    write_ball(folder / "ball.off", 160)
    write_plate(folder / "plate.off")
    subprocess.run([program, "template", "grid", "--box", *".43 .43 .43 1.57 1.57 1.57".split(), "--counts",
                    *"58 58 58".split(), "-o", folder / "block.mesh", "--quiet"], check=True)


def one_run(program, words, inputs, delay, number, most):
    """Seconds from the signal to the end and the exit status; None where the run ended before."""
    with tempfile.TemporaryDirectory() as name:
        process = subprocess.Popen([program, *words.format(i=inputs).split()], cwd=name, stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL,
                                   env={"OMP_NUM_THREADS": "1", **os.environ, "OMP_WAIT_POLICY": "passive"})
        try:
            process.wait(delay)
            return None
        except subprocess.TimeoutExpired:
            pass
        begin = time.monotonic()
        process.send_signal(number)
        try:
            status = process.wait(most)
        except subprocess.TimeoutExpired:
            process.kill()
            status = process.wait()
        seconds = time.monotonic() - begin
        left = [path.name for path in pathlib.Path(name).glob(".subvol-*")]
        return seconds, status, left


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("names", nargs="*", help="cases (default: all)")
    parser.add_argument("--runs", type=int, default=3, help="of each case")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=float, default=1.0, help="longest answer, in seconds")
    parser.add_argument("--longest", type=float, default=20.0, help="longest delay, in seconds")
    arguments = parser.parse_intermixed_args()
    program = arguments.program.resolve()
    rows, bad = [], []
    with tempfile.TemporaryDirectory() as folder:
        inputs = pathlib.Path(folder)
        make_inputs(program, inputs)
        for name, words in CASES:
            if arguments.names and name not in arguments.names:
                continue
            chance = random.Random(f"{arguments.seed} {name}")
            answers = []
            for _ in range(arguments.runs):
                delay = 0.1 * (arguments.longest / 0.1) ** chance.random()
                number = chance.choice([signal.SIGINT, signal.SIGTERM])
                found = one_run(program, words, inputs, delay, number, 60)
                if found is None:
                    continue
                seconds, status, left = found
                answers.append(seconds)
                print(f"{name:16} {signal.Signals(number).name} after {delay:6.2f} s: {seconds:6.2f} s, "
                      f"status {status}", flush=True)
                if seconds > arguments.limit:
                    bad.append(f"{name}: ended {seconds:.2f} s after a signal at {delay:.2f} s")
                if left or status not in (130, 0, 1, 4):
                    bad.append(f"{name}: status {status}, left {left}")
            if answers:
                rows.append((name, len(answers), max(answers)))
    print(f"\n{'case':16} {'signals':>7} {'slowest answer':>15}")
    for name, count, slowest in rows:
        print(f"{name:16} {count:7} {slowest:13.2f} s")
    print("\n".join(bad))
    if not rows:
        print("SKIPPED: every run ended before its signal")
        return 77
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
