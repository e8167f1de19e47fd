#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes one allocation or one call on a file fail, in one run after the other: none may crash, hang, or be half done.

Usage: tests/robustness/failing_calls.py PROGRAM SAMPLE_PROGRAM LIBRARY [--runs N] [--seed S] [NAME ...]

LIBRARY is what failing_calls.cpp is built to. Each case is run once to count its calls, then again and again with
another one that fails: the K-th, K spread over all by their logarithm and at random, half of the times with all that
come after it. A run must end by itself with a documented exit status, say why if it is not 0, leave no temporary, and
leave in place of each output what stood there before or what the run that nobody disturbed writes. Exit status: 0 all
held, 1 not, 77 where calls cannot be made to fail (no LD_PRELOAD).
"""
import argparse
import collections
import json
import pathlib
import random
import subprocess
import sys
import tempfile

import cases

OLD = b"what stood here before\n"
# Beside the cases of cases.py; what they write to is not compared but for the outputs named.
MORE_CASES = [
    ("check", "check {s}/torus_template.mesh --target {s}/torus_target.off --json", []),
    ("convert", "convert {s}/torus_template.mesh", ["out.vtk"]),
    ("subdivide", "subdivide {s}/torus_template.mesh --levels 2", ["out.mesh", "out.glb", "out.usda"]),
    ("edit", "template split {s}/torus_template.mesh --into tets", ["out.mesh"]),
]
QUICK = ["subdivide", "shell", "fit", "order", "check", "convert"]
STATUSES = {0, 1, 2, 3, 4}
SECONDS = 120


def command(program, case, samples):
    name, words, outputs = case
    if case in cases.CASES:
        return cases.command(program, case, samples)
    return [str(program), *words.format(s=samples).split(), *(["--force"] if outputs else []),
            *(word for output in outputs for word in ("-o", output))]


def names(case):
    return cases.file_names(case) if case in cases.CASES else case[2]


def ended_early(report):
    try:
        return json.loads(report)["stop_reason"] == "memory_limit"
    except (TypeError, ValueError, KeyError):
        return False


class Runner:
    def __init__(self, program, library, samples, case):
        self.program = program
        self.words, self.library, self.case = command(program, case, samples), library, case
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            done = self.run(folder, {"FAIL_COUNT": str(folder / "counts")})
            if not (folder / "counts").exists():
                print("SKIPPED: calls cannot be made to fail here", file=sys.stderr)
                sys.exit(77)
            self.status = done.returncode
            self.counts = dict(zip(("memory", "files"), map(int, (folder / "counts").read_text().split())))
            self.wanted = {output: cases.content(folder / output) for output in names(case)}

    def run(self, folder, settings):
        return subprocess.run(self.words, cwd=folder, capture_output=True, timeout=SECONDS,
                              env={**cases.environment(), "LD_PRELOAD": str(self.library), **settings})

    def is_whole(self, path):
        if path.suffix not in (".mesh", ".vtk", ".vtu"):
            return True
        return subprocess.run([self.program, "check", path], capture_output=True).returncode in (0, 1)

    def try_with(self, failing):
        """What is wrong with the run in which that call fails; and its exit status."""
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            before = {output: OLD for output in names(self.case) if random.random() < 0.5}
            for output, data in before.items():
                (folder / output).write_bytes(data)
            try:
                done = self.run(folder, {"FAIL": failing})
            except subprocess.TimeoutExpired:
                return ["does not end"], None
            errors = done.stderr.decode(errors="replace").strip()
            bad = []
            if done.returncode not in STATUSES:
                bad.append(f"ends with {done.returncode}")
            if done.returncode not in (0, 4, self.status) and not errors:  # 4: --quiet, the report says it
                bad.append(f"ends with {done.returncode} without a word")
            came_less_far = done.returncode == 4 and ended_early(cases.content(folder / "report.json"))
            for output in names(self.case):
                data = cases.content(folder / output)
                if came_less_far:
                    if data in (None, OLD) or not self.is_whole(folder / output):
                        bad.append(f"{output} is not there or not whole")
                elif data not in (before.get(output), self.wanted[output]):
                    bad.append(f"{output} is neither old nor whole")
                elif done.returncode == 0 and data != self.wanted[output]:
                    bad.append(f"says that all is done, but {output} is not written")
            left = {path.name for path in folder.iterdir()} - set(names(self.case))
            if left:
                bad.append(f"leaves {', '.join(sorted(left))}")
            return [f"{what} ({errors[-300:]})" for what in bad], done.returncode


def moments(count, runs):
    """Numbers of calls: the first and the last ones, the others spread by their logarithm and evenly."""
    chosen = {1, 2, 3, count, max(1, count - 1)}
    while len(chosen) < min(runs, count):
        chosen.add(int(count ** random.random()) if random.random() < 0.5 else random.randint(1, count))
    return sorted(chosen)[:runs] if runs >= len(chosen) else random.sample(sorted(chosen), runs)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("sample_program", type=pathlib.Path)
    parser.add_argument("library", type=pathlib.Path)
    parser.add_argument("names", nargs="*", help=f"cases (default: {' '.join(QUICK)})")
    parser.add_argument("--runs", type=int, default=20, help="of each case and kind of call")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_intermixed_args()
    random.seed(arguments.seed)
    program, library = arguments.program.resolve(), arguments.library.resolve()
    chosen = arguments.names or QUICK
    findings, statuses, runs = [], collections.Counter(), 0
    with tempfile.TemporaryDirectory() as folder:
        samples = pathlib.Path(folder)
        cases.make_samples(program, arguments.sample_program.resolve(), samples)
        for case in [case for case in cases.CASES + MORE_CASES if case[0] in chosen]:
            runner = Runner(program, library, samples, case)
            print(f"{case[0]}: {runner.counts['memory']} allocations, {runner.counts['files']} calls on files",
                  flush=True)
            for kind, count in runner.counts.items():
                for number in moments(count, arguments.runs) if count else []:
                    failing = f"{kind}:{number}{random.choice(['', '+'])}"
                    bad, status = runner.try_with(failing)
                    runs += 1
                    statuses[kind, status] += 1
                    for what in bad:
                        print(f"  {case[0]}, FAIL={failing}: {what}", flush=True)
                        findings.append(what)
    for kind in ("memory", "files"):
        told = [f"{count} with {status}" for (of, status), count in sorted(statuses.items(), key=str) if of == kind]
        print(f"exit status where {kind} failed: {', '.join(told)}")
    print(f"{runs} runs, {len(findings)} findings")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
