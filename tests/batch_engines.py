#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""batch_engines.py PROGRAM SAMPLES SOURCE ENGINE: runs a batch with an engine by its script in samples/batch, and compares
the records with those of `subvol batch` alone, byte by byte but for times.

ENGINE is parallel, futures, dask, slurm or snakemake. With slurm, a running task is killed and requeued. Exit status 0
if the records agree, 1 if not, 77 if the engine is not here.
"""
import difflib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SECONDS = 500


class Place:
    """A folder with samples, a manifest, and the program as $SUBVOL."""

    def __init__(self, program, samples, source, folder):
        self.program, self.scripts, self.folder = program, source / "samples" / "batch", folder
        self.environment = {**os.environ, "SUBVOL": str(program), "PATH": f"/usr/bin:{os.environ['PATH']}"}
        self.run(samples, ".")
        with open(folder / "models.jsonl", "w") as rows:
            for name in ("ball", "bracket", "torus"):
                for cells in (20, 30, 40):
                    rows.write(json.dumps({"id": f"{name}/{cells}", "verb": "template auto", "cells": cells,
                                           "input": f"{name}_target.off"}) + "\n")
            rows.write(json.dumps({"id": "gone", "verb": "check", "input": "gone.off"}) + "\n")

    def run(self, *words, status=(0,), **more):
        done = subprocess.run([str(word) for word in words], cwd=self.folder, env=self.environment, timeout=SECONDS,
                              stdout=subprocess.PIPE, text=True, **more)
        if done.returncode not in status:
            raise SystemExit(f"status {done.returncode}: {' '.join(map(str, words))}\n{done.stdout}")
        return done.stdout

    def merged(self, folder):
        self.run(self.program, "batch", "merge", folder, "-o", f"{folder}.jsonl", "--reproducible")
        return (self.folder / f"{folder}.jsonl").read_bytes()

    def num_records(self, folder):
        path = self.folder / folder / "records.jsonl"
        return path.read_bytes().count(b"\n") if path.exists() else 0


def with_parallel(place):
    place.run(place.scripts / "with_parallel.sh", "models.jsonl", "out", 4, "-j", 2)
    assert (place.folder / "out" / "report.html").exists()


def with_python(script):
    return lambda place: place.run("python3", place.scripts / script, "models.jsonl", "out", status=(1,),
                                   stderr=subprocess.DEVNULL)


def with_slurm(place):
    words = [Path(word).resolve() for word in (__file__, *sys.argv[1:4])]
    print(place.run(place.scripts / "one_machine_slurm.sh", place.folder / "slurm", sys.executable, *words,
                    "inside slurm", place.folder, status=(0, 77)), end="")
    if not place.num_records("out"):
        print("SKIPPED: Slurm does not start on this machine")
        sys.exit(77)


def inside_slurm(place):
    """Submits an array of eight shards, requeues one that runs, and waits for the end."""
    place.run("sbatch", "--array=1-8", place.scripts / "slurm_array.sh", "models.jsonl", "out")
    killed = 0
    end = time.monotonic() + SECONDS
    while time.monotonic() < end:
        tasks = [line.split() for line in place.run("squeue", "--noheader", "--array", "--format=%A %T").splitlines()]
        if not tasks:
            break
        running = [task for task, state in tasks if state == "RUNNING"]
        if running and killed < 1 and place.num_records("out") >= 1:
            place.run("scontrol", "requeue", running[0], status=(0, 1))
            # A requeued task waits two minutes for its old node; here nothing is to be waited for.
            killed += 1
        place.run("scontrol", "update", f"JobId={','.join(task for task, _ in tasks)}", "StartTime=now", status=(0, 1),
                  stderr=subprocess.DEVNULL)
        time.sleep(1)
    print(f"{killed} tasks killed and requeued")


def with_snakemake(place):
    surfaces = place.folder / "surfaces"
    surfaces.mkdir()
    for name in ("ball", "torus"):
        shutil.copy(place.folder / f"{name}_target.off", surfaces / f"{name}.off")
    words = ["snakemake", "--snakefile", place.scripts / "Snakefile", "--directory", "work", "--cores", 2, "--keep-going",
             "--config", f"surfaces={surfaces}", f"subvol={place.program}"]
    place.run(*words, stderr=subprocess.DEVNULL)
    lines = (place.folder / "work" / "checks.txt").read_text().splitlines()
    print("\n".join(lines))
    assert len(lines) == 2 and all(" True " in line for line in lines)
    assert all((place.folder / "work" / name / "page.html").exists() for name in ("ball", "torus"))


def has_module(name):
    return subprocess.run(["python3", "-c", f"import {name}"], stderr=subprocess.DEVNULL,
                          env={**os.environ, "PATH": f"/usr/bin:{os.environ['PATH']}"}).returncode == 0


ENGINES = {
    "parallel": (with_parallel, lambda: shutil.which("parallel"), "GNU parallel (parallel)"),
    "futures": (with_python("with_futures.py"), lambda: True, ""),
    "dask": (with_python("with_dask.py"), lambda: has_module("distributed"), "Dask (python3-distributed)"),
    "slurm": (with_slurm, lambda: shutil.which("slurmctld") and shutil.which("munged") and os.getuid() == 0,
              "Slurm (slurm-wlm, munge) and to be root"),
    "snakemake": (with_snakemake, lambda: shutil.which("snakemake"), "Snakemake (snakemake)"),
}


def main():
    program, samples, source = (Path(word).resolve() for word in sys.argv[1:4])
    if sys.argv[4] == "inside slurm":
        place = Place.__new__(Place)
        place.program, place.scripts, place.folder = program, source / "samples" / "batch", Path(sys.argv[5])
        place.environment = dict(os.environ)
        inside_slurm(place)
        return 0
    work, is_here, needs = ENGINES[sys.argv[4]]
    if not is_here():
        print(f"SKIPPED: needs {needs}")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        place = Place(program, samples, source, Path(folder))
        work(place)
        if sys.argv[4] == "snakemake":
            return 0
        place.run(program, "batch", "models.jsonl", "-o", "alone", "--quiet", status=(1,))
        found, wanted = (place.merged(name).decode().splitlines() for name in ("out", "alone"))
        if found != wanted:
            print("the records differ from those of subvol batch alone:")
            print("\n".join(difflib.unified_diff(wanted, found, "alone", sys.argv[4], n=0, lineterm="")))
            return 1
    print("10 models, the same records")
    return 0


if __name__ == "__main__":
    sys.exit(main())
