#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The program runs with OpenMP threads that spin for a short time and with huge pages, unless the user has set these.
It also runs if the loader is asked to start it.

    runtime_settings.py PROGRAM SAMPLES
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import time

KNOWN = ("OMP_WAIT_POLICY", "GOMP_SPINCOUNT", "GLIBC_TUNABLES")
SPINS = {"GOMP_SPINCOUNT": "1000"}
HUGE_PAGES = {"GLIBC_TUNABLES": "glibc.malloc.hugetlb=1"}


def running(program, samples, folder, expected, **settings):
    """Returns the name of the process of a fit, and those of the known settings that it runs with.

    A busy machine starts programs slowly: the process is asked until it runs as expected, for 20 seconds at most.
    """
    environment = {name: value for name, value in os.environ.items() if name not in KNOWN} | settings
    words = [program, "fit", samples / "torus_target.off", "--template", samples / "torus_template.mesh", "--levels", "3",
             "-o", folder / "out.mesh", "--force", "--quiet"]
    process = subprocess.Popen(words, env=environment)
    process_folder = pathlib.Path("/proc") / str(process.pid)
    end = time.monotonic() + 20
    found = None
    while found != expected and process.poll() is None and time.monotonic() < end:
        time.sleep(0.1)
        name = (process_folder / "comm").read_text().strip()
        entries = (entry.partition("=") for entry in (process_folder / "environ").read_text().split("\0"))
        found = name, {key: value for key, _, value in entries if key in KNOWN}
    process.terminate()
    process.wait()
    return found


def main():
    program, writer = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    if not os.path.isdir("/proc/self"):
        print("SKIPPED: no /proc")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        subprocess.run([writer, folder / "samples"], check=True, stdout=subprocess.DEVNULL)
        own = os.path.basename(program)
        for settings, expected in (({}, SPINS | HUGE_PAGES),
                                   ({"OMP_WAIT_POLICY": "active"}, {"OMP_WAIT_POLICY": "active"} | HUGE_PAGES),
                                   ({"GOMP_SPINCOUNT": "7"}, {"GOMP_SPINCOUNT": "7"} | HUGE_PAGES),
                                   ({"GLIBC_TUNABLES": "glibc.malloc.hugetlb=0"},
                                    {"GLIBC_TUNABLES": "glibc.malloc.hugetlb=0"} | SPINS)):
            found = running(program, folder / "samples", folder, (own, expected), **settings)
            if found != (own, expected):
                print(f"with {settings}: expected {own} with {expected}, found {found}")
                return 1
    loader = next(pathlib.Path("/lib64").glob("ld-linux-*.so.*"), None)
    if loader:
        words = [loader, program, "--version"]
        through_loader = subprocess.run(words, capture_output=True, text=True, check=False).stdout
        if not through_loader.startswith("subvol "):
            print(f"through the loader, --version printed: {through_loader}")
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
