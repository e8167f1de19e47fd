#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs_commands.py PROGRAM SAMPLES SOURCE [PAGE ...]: runs every command of README.md and docs, as it stands there.

Each page has a folder of its own, with what SAMPLES writes, `subvol` on the PATH and both programs under build/release.
Commands are the lines of indented or ```sh blocks that begin with one of PROGRAMS; a backslash joins lines. Remarks
before a block say what is special:

    <!-- not run: WHY -->   the block is for reading
    <!-- exits 3 -->        each command of the block ends with this status, and not with 0
    <!-- says -->           no command: every line of the block is in what the last command has said

Exit status 0 where all commands end as they should, 1 with the page, line and words of each that does not.
"""
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROGRAMS = ("subvol", "build/release/subvol", "build/release/subvol_samples", "cmake", "cmake/install_packages", "npm",
            "python3", "venv/bin/python", "./quickstart", "./runtests", "tests/fuzz/run.py", "tests/robustness/",
            "node", "apt-get", "blender", "cd", "echo", "source", "ctest", "ninja", "git", "SUBVOL_FUZZ_SECONDS")
REMARK = re.compile(r"^<!-- (not run: .+|exits \d+|says) -->$")


class Block:
    def __init__(self, line, remark, lines):
        self.line, self.remark, self.lines = line, remark, lines

    def commands(self):
        """(line, words) of every command, continuation lines joined."""
        found, begun = [], None
        for k, text in enumerate(self.lines):
            if begun is None and not text.startswith(PROGRAMS):
                continue
            number, words = begun or (self.line + k, "")
            words += text.strip()
            begun = (number, words[:-1]) if words.endswith("\\") else None
            if begun is None:
                found.append((number, words))
        return found


def blocks(text):
    """The indented and ```sh or ``` blocks of a page, with the remark before each."""
    remark, lines, start, fence = "", [], 0, None
    for number, line in enumerate(text.splitlines() + ["end"], 1):
        fenced = line.startswith("```")
        if fence is not None:
            if fenced:
                if fence in ("", "sh"):
                    yield Block(start, remark, lines)
                remark, lines, fence = "", [], None
            else:
                lines.append(line)
            continue
        if lines and not (line.startswith("    ") or not line.strip()):
            yield Block(start, remark, lines)
            remark, lines = "", []
        if fenced:
            fence, start = line[3:].strip(), number + 1
        elif line.startswith("    "):
            start = start if lines else number
            lines.append(line[4:])
        elif lines:
            lines.append("")
        elif REMARK.match(line):
            remark = REMARK.match(line).group(1)
        elif line.strip():
            remark = ""


def run_page(page, text, environment, folder):
    """What went wrong, and how many commands ran."""
    wrong, ran, said = [], 0, ""
    for block in blocks(text):
        if block.remark == "says":
            for k, line in enumerate(block.lines):
                if line.strip() and line.strip() not in said:
                    wrong.append(f"{page}:{block.line + k}: not said: {line.strip()}\n{said}")
            continue
        if block.remark.startswith("not run"):
            continue
        wanted = int(block.remark.split()[1]) if block.remark else 0
        for number, words in block.commands():
            begin = time.time()
            done = subprocess.run(["bash", "-c", words], cwd=folder, env=environment, capture_output=True, text=True)
            said = done.stdout + done.stderr
            ran += 1
            print(f"{page}:{number}: {time.time() - begin:5.1f} s  {words}", flush=True)
            if done.returncode != wanted:
                wrong.append(f"{page}:{number}: status {done.returncode}, expected {wanted}: {words}\n{said}")
    return wrong, ran


def main():
    program, samples, source = (Path(word).resolve() for word in sys.argv[1:4])
    pages = [Path(word) for word in sys.argv[4:]] or [Path("README.md"), *sorted(
        path.relative_to(source) for path in (source / "docs").rglob("*.md"))]
    wrong, ran = [], 0
    for page in pages:
        with tempfile.TemporaryDirectory() as folder:
            build = Path(folder, "build", "release")
            build.mkdir(parents=True)
            (build / "subvol").symlink_to(program)
            (build / "subvol_samples").symlink_to(samples)
            subprocess.run([samples, folder], check=True)
            environment = {**os.environ, "PATH": f"{build}:{os.environ['PATH']}"}
            text = (source / page).read_text()
            page_wrong, page_ran = run_page(page, text, environment, folder)
            wrong += page_wrong
            ran += page_ran
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"{ran} commands of {len(pages)} pages, {usage.ru_utime + usage.ru_stime:.1f} s of processor time")
    for text in wrong:
        print(text, file=sys.stderr)
    return 1 if wrong or not ran else 0


if __name__ == "__main__":
    sys.exit(main())
