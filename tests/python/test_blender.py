# SPDX-License-Identifier: GPL-3.0-or-later
"""Cages in Blender: its Subdivision Surface modifier makes our limit surface of them."""

import os
import subprocess
import unittest

import numpy as np

import subvol
from common import CUBE, CUBE_POINTS, PROGRAM, SOURCE, InFolder

BLENDER, ADDON = os.environ["SUBVOL_BLENDER"], os.environ["SUBVOL_BLENDER_ADDON"]


def farthest(a, b):
    """Largest distance of a point of a from the closest one of b."""
    return max(np.sqrt(((part[:, None] - b) ** 2).sum(axis=2).min(axis=1)).max() for part in np.array_split(a, 50))


class Cages(InFolder):
    def cages(self):
        torus, bracket = (subvol.read(f"{name}_template.mesh") for name in ("torus", "bracket"))
        fitted = subvol.fit("bracket_target.off", bracket, levels=1).cage
        half_sharp = subvol.VolumeMesh(CUBE_POINTS, hexes=CUBE, creases=[[0, 1], [1, 2], [2, 6], [6, 5]],
                                       crease_sharpness=[1, 2, 3, 10], corners=[7], corner_sharpness=[1.5])
        dart = subvol.VolumeMesh(CUBE_POINTS, hexes=CUBE, creases=[[0, 1], [1, 2], [1, 5]])
        return {"dart": dart, "torus": torus, "bracket": bracket, "fitted": fitted, "half_sharp": half_sharp,
                "tets": subvol.template.split(torus, into="tets")}

    def test_the_modifier_makes_our_limit_surface(self):
        cages = self.cages()
        for name, cage in cages.items():
            subvol.write(f"{name}.mesh", cage)
        done = subprocess.run(
            [BLENDER, "-b", "--factory-startup", "--python-exit-code", "1", "--python",
             os.path.join(SOURCE, "tests", "python", "in_blender.py"), "--", ADDON, PROGRAM,
             *(os.path.abspath(f"{name}.mesh") for name in cages)],
            capture_output=True, text=True, env={**os.environ, "BLENDER_USER_SCRIPTS": os.path.abspath("scripts"),
                                                 "BLENDER_USER_CONFIG": os.path.abspath("config")})
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        for name, cage in cages.items():
            fine = subvol.subdivide(cage, levels=3)
            fine.points[:] = subvol.limit_matrix(fine).apply(fine.points)
            wanted, found = fine.boundary().points, np.load(f"{name}.npy")
            self.assertEqual(wanted.shape, found.shape, name)
            distance, extent = max(farthest(found, wanted), farthest(wanted, found)), np.ptp(wanted, axis=0)
            percent = 100 * distance / np.linalg.norm(extent)
            print(f"{name}: {percent:.2g} % of the diagonal")
            # Blender only approximates what is around half-sharp features.
            self.assertLess(percent, 0.005 if name == "half_sharp" else 0.001, name)


if __name__ == "__main__":
    unittest.main()
