#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the benchmarks of a build folder and prints their figures and ratios as tables.

Usage: bench/run.py BUILD_FOLDER [NAME ...]    (configure with -DSUBVOL_BUILD_BENCH=ON)
The JSON of each goes to BUILD_FOLDER/bench_NAME.json.
"""
import json
import pathlib
import subprocess
import sys


def table(rows):
    keys = list(dict.fromkeys(key for row in rows for key in row))
    cells = [keys] + [[str(row.get(key, "")) for key in keys] for row in rows]
    widths = [max(len(line[i]) for line in cells) for i in range(len(keys))]
    for line in cells:
        print("  " + "  ".join(text.rjust(width) for text, width in zip(line, widths)))


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    build = pathlib.Path(sys.argv[1])
    programs = sorted(p for p in build.rglob("bench_*") if p.is_file() and p.stat().st_mode & 0o111 and not p.suffix)
    wanted = sys.argv[2:]
    if not programs:
        sys.exit(f"{build}: no benchmarks here; configure with -DSUBVOL_BUILD_BENCH=ON")
    for program in programs:
        name = program.name.removeprefix("bench_")
        if wanted and name not in wanted:
            continue
        output = subprocess.run([str(program.resolve())], check=True, capture_output=True, text=True).stdout
        (build / f"{program.name}.json").write_text(output)
        data = json.loads(output)
        print(f"{name}: " + ", ".join(f"{key} {value}" for key, value in data.items() if not isinstance(value, list)))
        for rows in (value for value in data.values() if isinstance(value, list)):
            table([row if isinstance(row, dict) else {"value": row} for row in rows])


if __name__ == "__main__":
    main()
