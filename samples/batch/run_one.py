# SPDX-License-Identifier: GPL-3.0-or-later
"""run_one(row, folder): runs one model of a batch and returns its record, for any engine that maps a function over
rows: concurrent.futures, Dask, and others (docs/batch.md)."""
import json
import os
import subprocess


def read_rows(path):
    """The rows of a manifest of JSON lines."""
    with open(path) as lines:
        return [json.loads(line) for line in lines if line.strip()]


def run_one(row, folder, program=os.environ.get("SUBVOL", "subvol"), options=()):
    """Runs a model, unless the folder has a record of the same work, and returns its record as a dict.

    row      dict with "input", and if need be "id", "verb", "options", "outputs", or options by their names; files are
             relative to the current folder.
    folder   of the batch; all workers may share one.
    options  words for `subvol batch`: ["--time-limit", "600"].
    RuntimeError: the row makes no sense, or another worker runs the model. A model that fails is no error.
    """
    words = [program, "batch", "--row", json.dumps(row), "-o", folder, "--jobs", "1", "--print", "--quiet", *options]
    done = subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if done.returncode not in (0, 1, 4) or not done.stdout:
        raise RuntimeError(f"{row}: {done.stderr.strip() or 'another worker runs it'}")
    return json.loads(done.stdout)
