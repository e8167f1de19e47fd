#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Says what share of the surfaces in a folder become valid volume meshes, and what becomes of the others.

Usage: tests/wild/wild.py PROGRAM FOLDER -o BATCH [--verb VERB] [--largest MB] [--page PAGE.html] [-- OPTIONS ...]

FOLDER is searched with all folders inside it. Each surface is a model of a batch (docs/batch.md) in BATCH, which goes
on where it was ended if it is called again. What follows -- goes to `subvol batch`: --jobs 4 --time-limit 600, and
behind another --, to every model. Exit status: that of the batch (1: some have failed), 2: there is no surface.
"""
import argparse
import json
import pathlib
import subprocess
import sys

SURFACES = (".off", ".obj", ".stl", ".ply")


def surfaces_in(folder, largest):
    """The surfaces in a folder, ordered by name."""
    return sorted(path for path in folder.rglob("*")
                  if path.suffix.lower() in SURFACES and path.is_file() and path.stat().st_size <= largest * 1e6)


def write_manifest(path, folder, surfaces, verb):
    with path.open("w") as rows:
        for surface in surfaces:
            row = {"id": str(surface.relative_to(folder)), "verb": verb, "input": str(surface.resolve())}
            rows.write(json.dumps(row) + "\n")


def table(summary):
    lines = [f"{summary['models']} surfaces, {100 * summary['valid_share']:.1f} % valid, "
             f"{100 * summary['result_share']:.1f} % with a valid mesh"]
    for name, count in sorted(summary.get("classes", {}).items(), key=lambda item: -item[1]):
        lines.append(f"{count:6d}  {100 * count / summary['models']:5.1f} %  {name}")
    return "\n".join(lines)


def main():
    words = sys.argv[1:]
    at = words.index("--") if "--" in words else len(words)
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    parser.add_argument("--verb", default="fit")
    parser.add_argument("--largest", type=float, default=1e6, help="leave out larger files, in MB")
    parser.add_argument("--page", type=pathlib.Path)
    arguments = parser.parse_args(words[:at])
    surfaces = surfaces_in(arguments.folder, arguments.largest)
    if not surfaces:
        print(f"{arguments.folder}: there is no surface ({' '.join(SURFACES)})", file=sys.stderr)
        return 2
    program = str(arguments.program.resolve())
    arguments.output.mkdir(parents=True, exist_ok=True)
    manifest = arguments.output / "surfaces.jsonl"
    write_manifest(manifest, arguments.folder, surfaces, arguments.verb)
    done = subprocess.run([program, "batch", manifest, "-o", arguments.output, *words[at + 1:]])
    if done.returncode in (2, 3):
        return done.returncode
    page = ["-o", arguments.page, "--force"] if arguments.page else []
    report = subprocess.run([program, "batch", "report", arguments.output, "--json", *page], check=True,
                            stdout=subprocess.PIPE, text=True)
    print(table(json.loads(report.stdout)))
    return done.returncode


if __name__ == "__main__":
    sys.exit(main())
