#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hundreds of fits, shells and optimizations of random shapes; nothing may crash, hang, or claim what is not so.

Usage: tests/robustness/soak.py PROGRAM [--runs N] [--first K] [--seed S] [--time-limit T] [--minutes M] [--keep FOLDER]

Shapes are balls, tori and sheets, plates, needles, solids with cavities in cavities, parts that nearly touch, all of
them also with noise, holes, flipped and repeated faces; soups of triangles; blocks of cells with inner vertices thrown
about; in units from 1e-12 to 1e12 and far from the origin.

Each run is a function of its number and the seed. A finding is: an exit status that is not documented, or not one of
that verb's; more processor time than the limit and a minute; an error without words; a temporary left behind; or a
claim of the report that `subvol check` of the file written does not bear out: number of cells, certified cells,
inverted cells, intersections, mean distance. Ends with a table; exit status 0 without findings, 1 with some. What was
found is kept in FOLDER.
"""
import argparse
import collections
import math
import pathlib
import random
import resource
import shutil
import subprocess
import sys
import tempfile
import time

import cases
import claims


def grid_surface(rng, point, n, m, wrap_u, wrap_v):
    """Vertices and quads of a map of the unit square; wrapped sides are glued."""
    rows, columns = n if wrap_u else n + 1, m if wrap_v else m + 1
    vertices = [point(i / n, j / m) for i in range(rows) for j in range(columns)]
    number = lambda i, j: (i % rows) * columns + j % columns
    faces = [[number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)]
             for i in range(n) for j in range(m)]
    if rng.random() < 0.5:
        faces = [t for a, b, c, d in faces for t in ([a, b, c], [a, c, d])]
    return vertices, faces


def waves(rng, strength):
    terms = [(rng.uniform(-1, 1) * strength, rng.randint(1, 5), rng.randint(0, 5), rng.uniform(0, 6)) for _ in range(3)]
    return lambda u, v: sum(a * math.sin(2 * math.pi * (k * u + l * v) + phase) for a, k, l, phase in terms)


def torus(rng):
    tube, bumps = rng.uniform(0.15, 0.6), waves(rng, rng.choice([0, 0.02, 0.05]))

    def point(u, v):
        r = tube * (1 + bumps(u, v))
        a, b = 2 * math.pi * u, 2 * math.pi * v
        return [(1 + r * math.cos(b)) * math.cos(a), (1 + r * math.cos(b)) * math.sin(a), r * math.sin(b)]
    return grid_surface(rng, point, rng.randint(12, 60), rng.randint(8, 30), True, True)


def ball(rng):
    """A cube's surface blown up: six patches glued by position."""
    n, power, bumps = rng.randint(3, 16), rng.choice([2, 2, 4, 8]), waves(rng, rng.choice([0, 0.03, 0.08]))
    size = [rng.uniform(0.3, 1) for _ in range(3)]
    vertices, numbers, faces = [], {}, []

    def number(p):
        if p not in numbers:
            numbers[p] = len(vertices)
            q = [2 * c / n - 1 for c in p]
            length = sum(abs(c) ** power for c in q) ** (1 / power)
            r = 1 + bumps(math.atan2(q[1], q[0]) / (2 * math.pi), 0)
            vertices.append([s * r * c / length for s, c in zip(size, q)])
        return numbers[p]
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, n):
            for i in range(n):
                for j in range(n):
                    corners = []
                    for di, dj in ((0, 0), (1, 0), (1, 1), (0, 1)):
                        p = [0, 0, 0]
                        p[axis], p[a], p[b] = side, i + di, j + dj
                        corners.append(number(tuple(p)))
                    faces.append(corners if side else corners[::-1])
    return vertices, [t for a, b, c, d in faces for t in ([a, b, c], [a, c, d])] if rng.random() < 0.7 else faces


def sheet(rng):
    bumps, bend = waves(rng, rng.choice([0, 0.05, 0.2])), rng.uniform(0, 2.5)

    def point(u, v):
        a = bend * (u - 0.5)
        return [math.sin(a) / max(bend, 0.1), v - 0.5, (1 - math.cos(a)) / max(bend, 0.1) + bumps(u, v)]
    return grid_surface(rng, point, rng.randint(3, 25), rng.randint(3, 25), False, False)


def scaled(surface, factors):
    return [[c * f for c, f in zip(v, factors)] for v in surface[0]], surface[1]


def joined(first, second, shift=(0, 0, 0)):
    vertices, faces = first
    return (vertices + [[c + s for c, s in zip(v, shift)] for v in second[0]],
            faces + [[v + len(vertices) for v in face] for face in second[1]])


def inside_out(surface):
    return surface[0], [face[::-1] for face in surface[1]]


def plate(rng):
    return scaled(ball(rng), rng.sample([1, 1, 10 ** rng.uniform(-3.5, -1)], 3))


def needle(rng):
    thin = 10 ** rng.uniform(-2.5, -1)
    return scaled(ball(rng), rng.sample([1, thin, thin], 3))


def hollow(rng):
    """A solid with a cavity, sometimes with a solid in that."""
    body = surface = ball(rng)
    for turn in range(rng.randint(1, 2)):
        body = inside_out(scaled(body, [rng.uniform(0.3, 0.97)] * 3))
        surface = joined(surface, body)
    return surface


def near_parts(rng):
    """Two parts with next to nothing between them, or a little of both in one place."""
    first, second = rng.choice([ball, torus])(rng), ball(rng)
    reach = max(v[0] for v in first[0]) - min(v[0] for v in second[0])
    return joined(first, second, (reach + rng.choice([-1, 1, 1, 1]) * 10 ** rng.uniform(-6, -1), 0, 0))


def soup(rng):
    vertices = [[rng.uniform(-1, 1) for _ in range(3)] for _ in range(3 * rng.randint(1, 60))]
    return vertices, [[v, v + 1, v + 2] for v in range(0, len(vertices), 3)]


def damaged(rng, surface):
    """With faces lost, flipped and repeated, vertices in other places and on one another."""
    vertices, faces = [list(v) for v in surface[0]], []
    share = rng.choice([0.005, 0.05])
    for face in surface[1]:
        fate = rng.random() / share
        if fate < 1:
            continue
        faces.append(face[::-1] if fate < 2 else face)
        if fate > 1 / share - 1:
            faces.append(face)
    for v in vertices:
        if rng.random() < share:
            v[:] = rng.choice(vertices)
    noise = rng.choice([0, 0.01, 0.1])
    return [[c + rng.gauss(0, noise) for c in v] for v in vertices], faces


SOLIDS = [ball, torus, plate, needle, hollow, near_parts]


def surface_of(rng, kinds):
    surface = rng.choice(kinds)(rng)
    return damaged(rng, surface) if rng.random() < 0.25 else surface


def placed(rng, vertices):
    """Another unit, another origin; sometimes a little noise."""
    widest = rng.choice([4, 4, 12])
    scale = 10 ** rng.uniform(-widest, widest)
    origin = [rng.choice([0, 0, 1, 100, 1e6]) * rng.uniform(-1, 1) * scale for _ in range(3)]
    noise = rng.choice([0, 0, 0, 1e-3])
    return [[o + scale * (c + rng.gauss(0, noise)) for o, c in zip(origin, v)] for v in vertices]


def write_off(path, surface, rng):
    vertices, faces = placed(rng, surface[0]), surface[1]
    lines = ["OFF", f"{len(vertices)} {len(faces)} 0"]
    lines += [" ".join(repr(c) for c in v) for v in vertices]
    lines += [" ".join(map(str, [len(f), *f])) for f in faces]
    path.write_text("\n".join(lines) + "\n")


def write_block(path, rng):
    """A block of hexes or of what they can be cut into, its inner vertices thrown about."""
    n = [rng.randint(1, 4) for _ in range(3)]
    mess = rng.choice([0.1, 0.4, 0.8, 2])
    unit = 10 ** rng.choice([0, rng.uniform(-12, 12)])
    edges = [unit * rng.choice([1, 1, 1, 10 ** rng.uniform(-3, 0)]) for _ in range(3)]
    at = lambda i, j, k: (i * (n[1] + 1) + j) * (n[2] + 1) + k + 1
    vertices, cells = [], []
    for i in range(n[0] + 1):
        for j in range(n[1] + 1):
            for k in range(n[2] + 1):
                inner = 0 < i < n[0] and 0 < j < n[1] and 0 < k < n[2]
                moved = [c + (rng.uniform(-mess, mess) if inner else 0) for c in (i, j, k)]
                vertices.append([e * c for e, c in zip(edges, moved)])
    for i in range(n[0]):
        for j in range(n[1]):
            for k in range(n[2]):
                cells.append([at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k), at(i, j, k + 1),
                              at(i + 1, j, k + 1), at(i + 1, j + 1, k + 1), at(i, j + 1, k + 1)])
    lines = ["MeshVersionFormatted 2", "Dimension 3", "Vertices", str(len(vertices))]
    lines += [" ".join(repr(float(c)) for c in v) + " 0" for v in vertices]
    if rng.random() < 0.4:
        tets = [[v[0], v[a], v[b], v[6]] for v in cells for a, b in ((1, 2), (2, 3), (3, 7), (7, 4), (4, 5), (5, 1))]
        lines += ["Tetrahedra", str(len(tets))] + [" ".join(map(str, t)) + " 0" for t in tets]
    else:
        lines += ["Hexahedra", str(len(cells))] + [" ".join(map(str, c)) + " 0" for c in cells]
    path.write_text("\n".join(lines + ["End"]) + "\n")


def fit_words(rng, folder):
    write_off(folder / "target.off", surface_of(rng, SOLIDS + [soup]), rng)
    words = f"fit target.off --cells {rng.choice([40, 300, 1200])}"
    if rng.random() < 0.35:
        return words + f" --order {rng.randint(1, 4)} --basis {rng.choice(['fourier', 'legendre'])}" + \
            rng.choice(["", " --adaptive"]) + rng.choice(["", " --tolerance 0.1"]), "out.vtu", "target.off"
    words += f" --levels {rng.randint(1, 2)}" + rng.choice(["", "", " --cage-only", " --crease-angle 30"]) + \
        rng.choice(["", " --surface mesh", " --boundary averaging", " --solver lbfgs", " --correspondence voronoi"]) + \
        rng.choice(["", " --tolerance 0.05", " --lambda-close 0.0001"])
    return words, "out.mesh", "target.off"


def shell_words(rng, folder):
    write_off(folder / "target.off", surface_of(rng, SOLIDS + [sheet, sheet, soup]), rng)
    words = f"shell target.off --thickness {rng.choice(['0.1%', '2%', '20%'])} --layers {rng.randint(1, 4)}" + \
        f" --side {rng.choice(['inward', 'outward', 'both'])}" + rng.choice(["", " --free-surface", " --straight"]) + \
        rng.choice(["", " --growth 1.5", " --crease-angle 30"])
    if "--straight" not in words and rng.random() < 0.25:
        return words + " --order 2", "out.vtu", None
    return words, "out.mesh", None


def optimize_words(rng, folder):
    write_block(folder / "block.mesh", rng)
    words = "optimize block.mesh" + rng.choice(["", " --fixed-boundary", " --sizes uniform", " --crease-angle 20"]) + \
        rng.choice(["", " --lambda 0.001", " --tolerance 0.001"])
    return words, "out.mesh", None


def processor_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


class Soak:
    def __init__(self, program, seed, time_limit, keep):
        self.program, self.seed, self.time_limit, self.keep = program, seed, time_limit, keep
        self.table = collections.Counter()
        self.findings = []

    def run(self, number):
        rng = random.Random(f"{self.seed} {number}")
        kinds = [("fit", fit_words), ("fit", fit_words), ("shell", shell_words), ("optimize", optimize_words)]
        verb, make = rng.choice(kinds)
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            words, output, target = make(rng, folder)
            words += rng.choice(["", " --max-iterations 5", " --max-iterations 5"])  # most runs are to be short
            command = [self.program, *words.split(), "--time-limit", str(self.time_limit), "-o", output, "--report",
                       "report.json", "--quiet"]
            begin = processor_seconds()
            try:
                done = subprocess.run(command, cwd=folder, capture_output=True, text=True, errors="replace",
                                      timeout=20 * self.time_limit + 600, env=cases.environment())
                seconds = processor_seconds() - begin
                bad, status = claims.judge(self.program, folder, verb, output, target, done), done.returncode
                if seconds > self.time_limit + 60:
                    bad.append(f"took {seconds:.0f} s")
            except subprocess.TimeoutExpired:
                seconds = processor_seconds() - begin
                bad, status = ["did not end"], "hangs"
            self.table[verb, status] += 1
            said = "" if status in (0, 4, "hangs") else " | " + done.stderr.strip().split("\n")[0][:120]
            print(f"{number:4} {status!s:5} {seconds:6.1f} s  {words}{said}", flush=True)
            for what in bad:
                self.findings.append((number, words, what))
                print(f"     FINDING: {what}", flush=True)
            if bad and self.keep:
                shutil.copytree(folder, self.keep / str(number), dirs_exist_ok=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--first", type=int, default=0, help="number of the first run")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--time-limit", type=float, default=20, help="of each run, in seconds")
    parser.add_argument("--minutes", type=float, default=math.inf, help="begin no run after this time")
    parser.add_argument("--keep", type=pathlib.Path)
    arguments = parser.parse_intermixed_args()
    soak = Soak(arguments.program.resolve(), arguments.seed, arguments.time_limit, arguments.keep)
    begin = time.monotonic()
    for number in range(arguments.first, arguments.first + arguments.runs):
        if time.monotonic() - begin > 60 * arguments.minutes:
            break
        soak.run(number)
    statuses = sorted({status for _, status in soak.table}, key=str)
    print("\nverb      " + "".join(f"{status!s:>8}" for status in statuses))
    for verb in sorted({verb for verb, _ in soak.table}):
        print(f"{verb:10}" + "".join(f"{soak.table[verb, status]:8}" for status in statuses))
    print(f"{sum(soak.table.values())} runs, {len(soak.findings)} findings")
    for number, words, what in soak.findings:
        print(f"{number}: {what}: {words}")
    return 1 if soak.findings else 0


if __name__ == "__main__":
    sys.exit(main())
