#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""with_dask.py MANIFEST.jsonl FOLDER [SCHEDULER]: runs a batch on a Dask cluster, or on two workers of this machine.

On a cluster, the workers share FOLDER and find run_one.py, which is sent to them.
"""
import sys
from pathlib import Path

from distributed import Client, LocalCluster, as_completed

from run_one import read_rows, run_one


def main():
    manifest, folder = sys.argv[1:3]
    local = None if len(sys.argv) > 3 else LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    failed = 0
    with Client(local or sys.argv[3]) as client:
        client.upload_file(str(Path(__file__).with_name("run_one.py")))
        models = client.map(run_one, read_rows(manifest), folder=folder, pure=False)
        for model in as_completed(models):
            record = model.result()
            print(record["id"], record["class"], record["reason"])
            failed += record["status"] == "failed"
    if local:
        local.close()
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
