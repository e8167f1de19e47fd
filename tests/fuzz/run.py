#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the fuzzers of a build folder, one after the other, and prints a table.

Usage: tests/fuzz/run.py BUILD_FOLDER [--seconds S] [--corpus FOLDER] [NAME ...]
       (cmake --preset fuzz && cmake --build build/fuzz;  an hour each: --seconds 3600)

Corpora are written by write_corpus into FOLDER (default: BUILD_FOLDER/corpus) and grow there; inputs that fail are kept
in BUILD_FOLDER/findings. Exit status: 0 without findings, 1 with some, 2 no fuzzers here.
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--seconds", type=int, default=10)
    parser.add_argument("--corpus", type=pathlib.Path)
    arguments = parser.parse_intermixed_args()
    build = arguments.build.resolve()
    fuzzers = sorted(p for p in build.rglob("fuzz_*") if p.is_file() and os.access(p, os.X_OK))
    fuzzers = [p for p in fuzzers if not arguments.names or p.name.removeprefix("fuzz_") in arguments.names]
    if not fuzzers:
        print(f"SKIPPED: {build} has no fuzzers; they need Clang: cmake --preset fuzz", file=sys.stderr)
        return 2
    corpus, findings = (arguments.corpus or build / "corpus").resolve(), build / "findings"
    findings.mkdir(exist_ok=True)
    subprocess.run([next(build.rglob("write_corpus")), corpus], check=True)
    failed = 0
    for fuzzer in fuzzers:
        name = fuzzer.name.removeprefix("fuzz_")
        timeout = 600 if name == "fit" else 30
        done = subprocess.run([fuzzer, f"-max_total_time={arguments.seconds}", f"-timeout={timeout}",
                               "-rss_limit_mb=2048", "-max_len=4096", "-print_final_stats=1", f"-artifact_prefix={findings}/{name}-",
                               corpus / name], env={**os.environ, "OMP_NUM_THREADS": "1"}, capture_output=True, text=True,
                              errors="replace")
        runs = re.search(r"stat::number_of_executed_units:\s*(\d+)", done.stderr)
        covered = re.findall(r" cov: (\d+)", done.stderr)
        print(f"{name:12} {runs.group(1) if runs else '?':>10} executions  {covered[-1] if covered else '?':>6} edges  "
              f"{len(list((corpus / name).iterdir())):6} inputs kept  {'clean' if done.returncode == 0 else 'FINDING'}",
              flush=True)
        if done.returncode != 0:
            failed += 1
            print("\n".join(line for line in done.stderr.splitlines()
                            if re.search(r"ERROR|SUMMARY|runtime error|Test unit written|^\s+#[0-9] ", line)), flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
