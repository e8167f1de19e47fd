#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits to damaged surfaces and shells on nasty ones, from real inputs; nothing may be claimed that is not so.

Usage: tests/robustness/hard_inputs.py PROGRAM DATA_FOLDER [--time-limit T] [NAME ...]

Takes DATA_FOLDER/dirty/NAME/target.off (or .xyz) with template.mesh, and DATA_FOLDER/shell/NAME/surface.off (or
.obj). What counts as a finding is in claims.py. Exit status: 0 without findings, 1 with some, 2 no such folder.
"""
import argparse
import pathlib
import subprocess
import sys
import tempfile

import cases
import claims


def fit_words(folder):
    """The command, and what the distance is measured to."""
    target = str(next(folder.glob("target.*")))
    return ["fit", target, "--template", str(folder / "template.mesh"), "--levels", "2"], target


def shell_words(folder):
    return ["shell", str(next(folder.glob("surface.*"))), "--thickness", "2%", "--layers", "2", "--side", "both"], None


def run(program, verb, words, target, time_limit):
    """What is wrong, the exit status, and what was said first."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        command = [program, *words, "--time-limit", str(time_limit), "-o", "out.mesh", "--report", "report.json",
                   "--quiet"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, errors="replace",
                              env=cases.environment())
        return claims.judge(program, folder, verb, "out.mesh", target, done), done.returncode, done.stderr.strip()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--time-limit", type=float, default=60, help="of each run, in seconds")
    arguments = parser.parse_intermixed_args()
    program, data = arguments.program.resolve(), arguments.data.resolve()
    findings = runs = 0
    for verb, kind, words_of in (("fit", "dirty", fit_words), ("shell", "shell", shell_words)):
        for folder in sorted((data / kind).glob("*/")):
            if arguments.names and folder.name not in arguments.names:
                continue
            words, target = words_of(folder)
            bad, status, said = run(program, verb, words, target, arguments.time_limit)
            runs += 1
            findings += len(bad)
            said = "" if status == 0 else " | " + said.split("\n")[0][:100]
            print(f"{verb:6} {folder.name:26} {status}  {'; '.join(bad) or 'true'}{said}", flush=True)
    if runs == 0:
        print(f"SKIPPED: nothing of that name in {data}", file=sys.stderr)
        return 2
    print(f"{runs} runs, {findings} findings")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
