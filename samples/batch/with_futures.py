#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""with_futures.py MANIFEST.jsonl FOLDER [WORKERS]: runs a batch with the executor of Python's standard library.

The work is done in processes of subvol: threads are enough to wait for them.
"""
import concurrent.futures
import sys

from run_one import read_rows, run_one


def main():
    manifest, folder = sys.argv[1:3]
    workers = int(sys.argv[3]) if len(sys.argv) > 3 else None
    failed = 0
    with concurrent.futures.ThreadPoolExecutor(workers) as pool:
        for record in pool.map(lambda row: run_one(row, folder), read_rows(manifest)):
            print(record["id"], record["class"], record["reason"])
            failed += record["status"] == "failed"
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
