#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Kills runs with SIGKILL at random moments, looks at what they leave, and resumes them until they are done.

Usage: tests/robustness/kill_and_resume.py PROGRAM SAMPLE_PROGRAM [--kills N] [--seed S] [NAME ...]

Half of the kills wait until a file is being written. After each, every output must be absent, what it was before, or
what the run that nobody disturbed writes; and the checkpoint, where there is one, must be good: the run is started
again with --resume, and killed again, until it ends by itself. Then all its files must be those of the undisturbed run,
byte by byte (reports but for times, cases.py). Runs are killed until N kills are done. Exit status: 0 all held, 1 not.
"""
import argparse
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time

import cases

OLD = b"what stood here before\n"
CHECKPOINT = "run.checkpoint"


class Chain:
    """One run from its start over all its kills to its end."""

    def __init__(self, program, case, samples, wanted, seconds):
        self.program, self.case, self.samples, self.wanted, self.seconds = program, case, samples, wanted, seconds
        self.kills = self.resumes = self.during_writes = 0
        self.bad = []

    def command(self, folder):
        extra = ["--checkpoint", CHECKPOINT, "--every", 0]
        if (folder / CHECKPOINT).exists():
            extra += ["--resume", CHECKPOINT]
            self.resumes += 1
        return cases.command(self.program, self.case, self.samples, extra)

    def wait_and_kill(self, process, folder):
        """False where the run was done before the moment came."""
        aims_at_write = random.random() < 0.5
        moment = time.monotonic() + random.uniform(0, 1.1 * self.seconds)
        while process.poll() is None:
            writes = any(folder.glob(".subvol-*.tmp"))
            if time.monotonic() >= moment and (writes or not aims_at_write):
                process.send_signal(signal.SIGKILL)
                process.wait()
                self.kills += 1
                self.during_writes += any(folder.glob(".subvol-*.tmp"))
                return True
            time.sleep(0.0003)
        return False

    def look(self, folder):
        for name in cases.file_names(self.case):
            path = folder / name
            if path.exists() and path.read_bytes() != OLD and cases.content(path) != self.wanted[name]:
                self.bad.append(f"{name} is neither old nor whole after kill {self.kills}")
        for left in folder.glob(".subvol-*"):
            left.unlink()  # a killed run cannot; no name of ours is one that anybody reads

    def run(self, most_kills):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            for output in cases.file_names(self.case):
                if random.random() < 0.5:
                    (folder / output).write_bytes(OLD)
            while True:
                process = subprocess.Popen(self.command(folder), cwd=folder, env=cases.environment(),
                                           stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
                if self.kills < most_kills and self.wait_and_kill(process, folder):
                    self.look(folder)
                    continue
                errors = process.communicate()[1].decode(errors="replace").strip()
                break
            if process.returncode not in (0, 4):
                self.bad.append(f"ended with {process.returncode}: {errors}")
            for output in cases.file_names(self.case):
                if cases.content(folder / output) != self.wanted[output]:
                    self.bad.append(f"{output} differs from that of the undisturbed run")


def undisturbed(program, case, samples):
    with tempfile.TemporaryDirectory() as folder:
        begin = time.monotonic()
        done = subprocess.run(cases.command(program, case, samples), cwd=folder, env=cases.environment(),
                              capture_output=True, text=True)
        if done.returncode not in (0, 4):
            sys.exit(f"{case[0]}: the undisturbed run ended with {done.returncode}: {done.stderr}")
        seconds = time.monotonic() - begin
        return {name: cases.content(pathlib.Path(folder) / name) for name in cases.file_names(case)}, seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("sample_program", type=pathlib.Path)
    parser.add_argument("names", nargs="*", help="cases that can be resumed (default: fit order)")
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_intermixed_args()
    random.seed(arguments.seed)
    program = arguments.program.resolve()
    names = arguments.names or ["fit", "order"]
    kills = resumes = during_writes = runs = 0
    bad = []
    with tempfile.TemporaryDirectory() as folder:
        samples = pathlib.Path(folder)
        cases.make_samples(program, arguments.sample_program.resolve(), samples)
        prepared = [(case, *undisturbed(program, case, samples)) for case in cases.CASES if case[0] in names]
        while kills < arguments.kills:
            case, wanted, seconds = prepared[runs % len(prepared)]
            chain = Chain(program, case, samples, wanted, seconds)
            chain.run(min(5, arguments.kills - kills))
            runs += 1
            kills += chain.kills
            resumes += chain.resumes
            during_writes += chain.during_writes
            bad += [f"{case[0]}: {what}" for what in chain.bad]
            if runs > 10 * arguments.kills:
                bad.append("the runs end before they can be killed")
                break
    print(f"{runs} runs, {kills} kills ({during_writes} during writes), {resumes} resumes, {len(bad)} findings")
    print("\n".join(bad))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
