#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the fuzzers of a build folder in rotation, and prints what all runs so far have come to.

Usage: tests/fuzz/run.py BUILD_FOLDER [--seconds S] [--rounds N] [--minutes M] [--jobs J] [--corpus FOLDER] [NAME ...]
       (cmake --preset fuzz && cmake --build build/fuzz;  an hour each: --seconds 600 --rounds 6)

Each round runs every fuzzer for S seconds, J of them at a time (default: 1). Corpora are written by write_corpus into FOLDER (default:
BUILD_FOLDER/corpus) and grow there, so that a run goes on where the last one ended; FOLDER/totals.json adds up
executions and seconds of processor time of each fuzzer over all runs. Inputs that fail are kept in
BUILD_FOLDER/findings, with what was said of them.
Exit status: 0 without findings in this run, 1 with some, 2 no fuzzers here.
"""
import argparse
import concurrent.futures
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import threading
import time

# Seconds by the clock that one input may take: generous, for the machine may be busy. What takes more than ten is kept
# as slow-unit beside the findings.
MOST_SECONDS = {"fit": 1200}
MOST_SECONDS_ELSE = 300

MOST_BYTES = {"cgns": 32768}  # of an input; the smallest file of HDF5 has 11 kB
MOST_BYTES_ELSE = 8192

# Readers that take a name get each input in a file; on a disk the processor would wait most of the time.
FOLDER_OF_INPUTS = next(p for p in (pathlib.Path("/dev/shm"), pathlib.Path(tempfile.gettempdir())) if os.access(p, os.W_OK))

# What other libraries leak is not ours to mend.
LEAKS = pathlib.Path(__file__).resolve().parents[2] / "cmake/leaks.txt"


def run_to_its_end(command, env):
    """Its exit status, what it wrote to stderr, and the seconds of processor time that it took."""
    with tempfile.TemporaryFile() as errors:
        child = subprocess.Popen(command, env=env, stdout=subprocess.DEVNULL, stderr=errors)
        _, status, used = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        errors.seek(0)
        return child.returncode, errors.read().decode(errors="replace"), used.ru_utime + used.ru_stime


class Fuzzing:
    def __init__(self, fuzzers, corpus, findings, seconds):
        self.fuzzers, self.corpus, self.findings, self.seconds = fuzzers, corpus, findings, seconds
        self.file = corpus / "totals.json"
        self.totals = json.loads(self.file.read_text()) if self.file.exists() else {}
        self.failed = 0
        self.lock = threading.Lock()

    def run(self, fuzzer):
        """One fuzzer for its seconds."""
        name = fuzzer.name.removeprefix("fuzz_")
        status, said, seconds = run_to_its_end(
            [fuzzer, f"-max_total_time={self.seconds}", f"-timeout={MOST_SECONDS.get(name, MOST_SECONDS_ELSE)}",
             "-rss_limit_mb=2048", f"-max_len={MOST_BYTES.get(name, MOST_BYTES_ELSE)}", "-print_final_stats=1",
             f"-artifact_prefix={self.findings}/{name}-", self.corpus / name],
            {**os.environ, "OMP_NUM_THREADS": "1", "TMPDIR": str(FOLDER_OF_INPUTS),
             "LSAN_OPTIONS": f"suppressions={LEAKS}:print_suppressions=0"})
        with self.lock:
            self.count(name, status, said, seconds)

    def count(self, name, status, said, seconds):
        executions = re.search(r"stat::number_of_executed_units:\s*(\d+)", said)
        if not executions:  # it failed: the last line with a number of executions
            executions = re.findall(r"^#(\d+)\s", said, re.MULTILINE)
        covered = re.findall(r" cov: (\d+)", said)
        count = int(executions.group(1) if isinstance(executions, re.Match) else executions[-1] if executions else 0)
        total = self.totals.setdefault(name, {"executions": 0, "processor_seconds": 0, "findings": 0, "edges": 0})
        total["executions"] += count
        total["processor_seconds"] += seconds
        total["edges"] = max(total["edges"], int(covered[-1]) if covered else 0)
        total["findings"] += status != 0
        self.file.write_text(json.dumps(self.totals, indent=1))
        print(f"{name:12} {count:10} executions  {'clean' if status == 0 else 'FINDING'}", flush=True)
        if status != 0:
            self.failed += 1
            (self.findings / f"{name}.log").write_text(said)
            telling = re.compile(r"ERROR|SUMMARY|runtime error|Test unit written|^\s+#[0-9] ")
            print("\n".join(line for line in said.splitlines() if telling.search(line)), flush=True)

    def print_totals(self):
        print(f"\n{'all runs':12} {'executions':>12} {'edges':>7} {'inputs':>7} {'minutes':>8} {'findings':>9}")
        for name, total in sorted(self.totals.items()):
            inputs = len(list((self.corpus / name).iterdir()))
            print(f"{name:12} {total['executions']:12} {total['edges']:7} {inputs:7} "
                  f"{total['processor_seconds'] / 60:8.1f} {total['findings']:9}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--seconds", type=int, default=10)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=math.inf, help="begin nothing after this time")
    parser.add_argument("--jobs", type=int, default=1)
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
    fuzzing = Fuzzing(fuzzers, corpus, findings, arguments.seconds)
    begin = time.monotonic()

    def run_in_time(fuzzer):
        if time.monotonic() - begin <= 60 * arguments.minutes:
            fuzzing.run(fuzzer)

    with concurrent.futures.ThreadPoolExecutor(max(1, min(arguments.jobs, len(fuzzers)))) as pool:
        for _ in pool.map(run_in_time, fuzzers * arguments.rounds):
            pass
    fuzzing.print_totals()
    return 1 if fuzzing.failed else 0


if __name__ == "__main__":
    sys.exit(main())
