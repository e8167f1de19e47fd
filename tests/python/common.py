# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of the Python module share: a folder with the bundled samples, the program, a locale."""

import contextlib
import locale
import os
import shutil
import struct
import subprocess
import tempfile
import unittest
import unittest.mock
import warnings

import numpy as np

import subvol

PROGRAM = os.environ.get("SUBVOL_PROGRAM", "")
SAMPLES = os.environ.get("SUBVOL_SAMPLES", "")
SOURCE = os.environ["SUBVOL_SOURCE_DIR"]

CUBE_POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
CUBE = np.arange(8).reshape(1, 8)


def cube():
    return subvol.VolumeMesh(CUBE_POINTS, hexes=CUBE)


@contextlib.contextmanager
def decimal_comma():
    """The C library's numbers have a decimal comma within, by a locale made here; skips where that cannot be."""
    before = locale.setlocale(locale.LC_NUMERIC)
    with tempfile.TemporaryDirectory() as folder, unittest.mock.patch.dict(os.environ, LOCPATH=folder):
        os.mkdir(f"{folder}/comma")
        with open(f"{folder}/comma/LC_NUMERIC", "wb") as file:  # as glibc's localedef writes it
            file.write(struct.pack("=8I4s2I", 0x20031115 ^ locale.LC_NUMERIC, 6, 32, 34, 35, 36, 40, 44,
                                   b",", ord(","), 0) + b"ANSI_X3.4-1968\0")
        try:
            locale.setlocale(locale.LC_NUMERIC, "comma")
        except locale.Error:
            raise unittest.SkipTest("the C library takes no locale but its own")
        try:
            assert locale.localeconv()["decimal_point"] == ","
            yield
        finally:
            locale.setlocale(locale.LC_NUMERIC, before)


class InFolder(unittest.TestCase):
    """Each test runs in a folder of its own that holds the samples."""

    @classmethod
    def setUpClass(cls):
        cls.samples = tempfile.mkdtemp()
        subprocess.run([SAMPLES, cls.samples], check=True, stdout=subprocess.DEVNULL)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.samples)

    def setUp(self):
        self.before = os.getcwd()
        self.folder = tempfile.mkdtemp()
        for name in os.listdir(self.samples):
            os.symlink(os.path.join(self.samples, name), os.path.join(self.folder, name))
        os.chdir(self.folder)
        warnings.simplefilter("ignore", UserWarning)

    def tearDown(self):
        os.chdir(self.before)
        shutil.rmtree(self.folder)

    def run_program(self, *words, status=0):
        if not PROGRAM:
            self.skipTest("the program is not built")
        done = subprocess.run([PROGRAM, *words, "--quiet"], capture_output=True, text=True)
        self.assertEqual(done.returncode, status, done.stderr)

    def assert_same_file(self, a, b):
        with open(a, "rb") as one, open(b, "rb") as two:
            self.assertEqual(one.read(), two.read(), f"{a} and {b} differ")
