# SPDX-License-Identifier: GPL-3.0-or-later
"""What a run may not do: end in no documented way, leave a temporary, or claim what `subvol check` does not find."""
import json
import math
import subprocess

import cases

DOCUMENTED = {0, 1, 3, 4}


def judge(program, folder, verb, output, target, done):
    """What is wrong with a run of `program` in `folder` that has ended: a list of words.

    verb, output, target  as on its command line; target is what distances are measured to, or None
    done                  what subprocess.run returned
    """
    bad = []
    status = done.returncode
    if status not in DOCUMENTED:
        bad.append(f"exit status {status}")
    if status in (1, 3) and not done.stderr.strip() and not (folder / "report.json").exists():
        bad.append("failed without a word")
    if any(folder.glob(".subvol-*")):
        bad.append("left a temporary")
    if not (folder / "report.json").exists():
        if status in (0, 4):
            bad.append("ended well without a report")
        if (folder / output).exists() and status == 3:
            bad.append("was refused, with an output")
        return bad
    report = json.loads((folder / "report.json").read_text())
    if verb == "shell" and output.endswith(".vtu") and report.get("mesh", {}).get("min_order", 1) == 1:
        return bad  # left straight: a .vtu of linear cells, which is not read back
    check = subprocess.run([program, "check", output, "--json"] + (["--target", target] if target else []),
                           cwd=folder, capture_output=True, text=True, env=cases.environment())
    if check.returncode not in (0, 1):
        return bad + [f"its output cannot be checked: {check.stderr.strip()}"]
    found = json.loads(check.stdout)
    if (status == 0) and not (found["quality"]["certified_cells"] == found["quality"]["cells"]
                              and not found["boundary_self_intersections"]):
        bad.append("exit status 0 of a mesh that check does not find valid")
    for name in ("cells", "certified_cells") + (() if verb == "shell" else ("inverted_cells", "min_scaled_jacobian")):
        if found["quality"][name] != report["quality"][name]:
            bad.append(f"{name}: {report['quality'][name]} is claimed, check finds {found['quality'][name]}")
    if verb != "shell" and found["boundary_self_intersections"] != report["boundary_self_intersections"]:
        bad.append("intersections differ from what is claimed")
    distances = [one["distance"]["mean_percent"] for one in (found, report)] if target else [0, 0]
    if not math.isclose(*distances, rel_tol=1e-6):
        bad.append("the distance differs from what is claimed")
    return bad
