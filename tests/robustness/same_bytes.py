#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the cases with one thread, with two, and with two again, and compares all that they write.

Usage: tests/robustness/same_bytes.py PROGRAM SAMPLE_PROGRAM [NAME ...]     (no name: all cases)
Files are compared byte by byte, reports without times, memory and the words of the command line (cases.py).
Exit status: 0 all equal, 1 not.
"""
import pathlib
import subprocess
import sys
import tempfile
import time

import cases


def run(program, case, samples, threads):
    """Exit status and contents of the files."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(cases.command(program, case, samples, ["--threads", threads]), cwd=folder,
                              env=cases.environment(), capture_output=True)
        written = {name: cases.content(pathlib.Path(folder) / name) for name in cases.file_names(case)}
        return done.returncode, written


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    program, sample_program = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
    wanted = [case for case in cases.CASES if not sys.argv[3:] or case[0] in sys.argv[3:]]
    differing = 0
    with tempfile.TemporaryDirectory() as folder:
        samples = pathlib.Path(folder)
        cases.make_samples(program, sample_program, samples)
        for case in wanted:
            begin = time.monotonic()
            status, first = run(program, case, samples, 1)
            bad = [] if status in (0, 4) else [f"exit status {status}"]
            for label, threads in (("2 threads", 2), ("2 threads again", 2)):
                other_status, other = run(program, case, samples, threads)
                if other_status != status:
                    bad.append(f"{label}: exit status {other_status}, not {status}")
                bad += [f"{label}: {name} differs" for name in first
                        if first[name] is None or first[name] != other[name]]
            sizes = sum(len(data) for data in first.values() if data)
            print(f"{case[0]:14} {len(first)} files {sizes:9} bytes {time.monotonic() - begin:6.1f} s  "
                  + ("; ".join(bad) or "equal"), flush=True)
            differing += bool(bad)
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
