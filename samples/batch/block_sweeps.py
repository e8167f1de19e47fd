#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""block_sweeps.py MESH FOLDER [BLOCKS] [SWEEPS] [OPTIONS of optimize ...]: optimizes a hex mesh block by block, each in a
process that holds its block alone (docs/scaling.md).

The mesh is cut into slabs of equally many cells along its longest axis. In a sweep, first the slabs are optimized side by
side, with their boundaries frozen; then slabs of the same number of cells around the cuts, so that the vertices on the
cuts move as well. Each half of a sweep is a batch. Writes FOLDER/swept.mesh.
"""
import json
import os
import subprocess
import sys
from pathlib import Path

SUBVOL = os.environ.get("SUBVOL", "subvol")


def read_hexes(path):
    """Positions, as texts, and the vertices of the hexes (from 0) of a Medit mesh of hexes."""
    words = iter(Path(path).read_text().split())
    points, hexes = [], []
    for word in words:
        if word == "Vertices":
            points = [[next(words) for _ in range(4)][:3] for _ in range(int(next(words)))]
        elif word == "Hexahedra":
            hexes = [[int(next(words)) - 1 for _ in range(9)][:8] for _ in range(int(next(words)))]
    return points, hexes


def write_hexes(path, points, hexes):
    lines = ["MeshVersionFormatted 2", "Dimension 3", "Vertices", str(len(points))]
    lines += [" ".join(point) + " 0" for point in points]
    lines += ["Hexahedra", str(len(hexes))]
    lines += [" ".join(str(vertex + 1) for vertex in cell) + " 0" for cell in hexes]
    path.write_text("\n".join(lines + ["End", ""]))


def optimize_blocks(folder, points, hexes, blocks, options):
    """Optimizes disjoint lists of cells in processes of their own, and moves the vertices. Returns the records."""
    folder.mkdir(parents=True)
    vertices = []
    with open(folder / "blocks.jsonl", "w") as rows:
        for k, block in enumerate(blocks):
            vertices.append(sorted({vertex for cell in block for vertex in hexes[cell]}))
            number = {vertex: i for i, vertex in enumerate(vertices[k])}
            write_hexes(folder / f"block{k}.mesh", [points[v] for v in vertices[k]],
                        [[number[v] for v in hexes[cell]] for cell in block])
            rows.write(json.dumps({"id": str(k), "verb": "optimize", "input": f"block{k}.mesh",
                                   "options": ["--fixed-boundary", *options]}) + "\n")
    subprocess.run([SUBVOL, "batch", folder / "blocks.jsonl", "-o", folder / "out", "--quiet"], check=False)
    records = [json.loads(line) for line in (folder / "out" / "records.jsonl").read_text().splitlines()]
    for k, its_vertices in enumerate(vertices):
        result = folder / "out" / "models" / str(k) / "result.mesh"
        if result.exists():  # a block without a result stays as it is
            for vertex, point in zip(its_vertices, read_hexes(result)[0]):
                points[vertex] = point
    return records


def main():
    mesh, folder = sys.argv[1], Path(sys.argv[2])
    num_blocks, num_sweeps = (int(word) for word in (sys.argv[3:5] + ["2", "2"][len(sys.argv[3:5]):]))
    options = sys.argv[5:]
    points, hexes = read_hexes(mesh)
    box = [(min(float(p[k]) for p in points), max(float(p[k]) for p in points)) for k in range(3)]
    axis = max(range(3), key=lambda k: box[k][1] - box[k][0])
    order = sorted(range(len(hexes)), key=lambda cell: sum(float(points[v][axis]) for v in hexes[cell]))
    size = -(-len(hexes) // num_blocks)
    slabs = [order[at:at + size] for at in range(0, len(order), size)]
    shifted = [order[at:at + size] for at in range(size // 2, len(order) - size // 2, size)]
    for sweep in range(num_sweeps):
        for half, blocks in (("a", slabs), ("b", shifted)):
            for record in optimize_blocks(folder / f"sweep{sweep}{half}", points, hexes, blocks, options):
                run = record["run"]
                print(f"sweep {sweep}{half} block {record['id']}: {record['class']}, "
                      f"{record.get('cells', 0)} cells, least scaled Jacobian {record.get('min_scaled_jacobian', 0):.3f}, "
                      f"{run['cpu_seconds']:.1f} s, {run['peak_memory_bytes'] / 1e6:.0f} MB")
    write_hexes(folder / "swept.mesh", points, hexes)


if __name__ == "__main__":
    main()
