# SPDX-License-Identifier: GPL-3.0-or-later
"""run.py MODULE: runs the tests of one module of this folder. Exit status: 0 all passed, 1 some failed, 77 none failed
but some were skipped (each is named), as in tests/support/skipping.h."""

import sys
import unittest

program = unittest.main(module=sys.argv[1], argv=sys.argv[:1], exit=False)
for test, why in program.result.skipped:
    print(f"SKIPPED: {test}: {why}")
sys.exit(1 if not program.result.wasSuccessful() else 77 if program.result.skipped else 0)
