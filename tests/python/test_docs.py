# SPDX-License-Identifier: GPL-3.0-or-later
"""The sessions of docs/python.md run as they stand there."""

import os
import re
import unittest

import numpy as np

import subvol
from common import SOURCE, InFolder


def sessions():
    with open(os.path.join(SOURCE, "docs", "python.md")) as file:
        return re.findall(r"```python\n(.*?)```", file.read(), re.DOTALL)


class Docs(InFolder):
    def test_the_first_session_fits_the_sample(self):
        session = sessions()[0]
        self.assertLess(len(session.strip().splitlines()), 15)
        names = {}
        exec(session, names)
        self.assertTrue(names["fit"].report["valid"])
        for name, shape in (("points", 3), ("hexes", 8), ("quality", None)):
            self.assertIsInstance(names[name], np.ndarray)
            if shape:
                self.assertEqual(names[name].shape[1], shape)
        self.assertTrue(os.path.exists("torus.glb"))

    def test_the_others_run(self):
        for session in sessions()[1:]:
            with self.subTest(session):
                exec(session, {"subvol": subvol, "np": np})


if __name__ == "__main__":
    unittest.main()
