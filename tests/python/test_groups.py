# SPDX-License-Identifier: GPL-3.0-or-later
"""Groups of faces: as arrays, through files, and from a target to a result."""
import unittest

import numpy as np

import subvol
from common import CUBE, CUBE_POINTS, InFolder

FLOOR, ROOF = [0, 1, 2, 3], [7, 6, 5, 4]


def grouped_cube():
    return subvol.VolumeMesh(CUBE_POINTS, hexes=CUBE, grouped_faces=[ROOF, FLOOR], face_groups=[1, 0],
                             group_names=["floor", "roof"], group_numbers=[4, 9])


class Groups(InFolder):
    def test_arrays_come_out_sorted(self):
        mesh = grouped_cube()
        self.assertEqual(mesh.group_names, ["floor", "roof"])
        np.testing.assert_array_equal(mesh.group_numbers, [4, 9])
        np.testing.assert_array_equal(mesh.grouped_faces, [FLOOR, sorted(ROOF)])
        np.testing.assert_array_equal(mesh.face_groups, [0, 1])
        self.assertEqual(mesh.region_names, {})
        plain = subvol.VolumeMesh(CUBE_POINTS, hexes=CUBE)
        self.assertEqual(plain.group_names, [])
        self.assertEqual(plain.grouped_faces.shape, (0, 4))

    def test_the_boundary_has_them(self):
        boundary = grouped_cube().boundary()
        self.assertEqual(sorted(boundary.face_groups), [-1, -1, -1, -1, 0, 1])
        triangles = boundary.triangulated()
        self.assertEqual(sorted(triangles.face_groups), [-1] * 8 + [0, 0, 1, 1])

    def test_they_go_through_files(self):
        mesh = grouped_cube()
        for name in ("a.mesh", "b.mesh"):
            subvol.write(name, mesh)
            mesh = subvol.read(name)
            self.assertEqual(mesh.group_names, ["floor", "roof"])
        curved = subvol.HighOrderMesh(mesh, 2)
        subvol.write("a.vtu", curved)
        found = subvol.read("a.vtu")
        np.testing.assert_array_equal(found.grouped_faces, mesh.grouped_faces)
        self.assertEqual(found.group_names, mesh.group_names)

    def test_wrong_arrays_are_refused(self):
        for arrays in ({"face_groups": [0]}, {"group_names": ["a"]},
                       {"grouped_faces": [FLOOR], "face_groups": [1], "group_names": ["a"]},
                       {"grouped_faces": [[0, 1, 2, 8]], "face_groups": [0], "group_names": ["a"]},
                       {"grouped_faces": [[0, 1, -1, -1]], "face_groups": [0], "group_names": ["a"]},
                       {"grouped_faces": [FLOOR], "face_groups": [0], "group_names": ["a", "b"],
                        "group_numbers": [1, 1]}):
            with self.assertRaises(subvol.InputError, msg=str(arrays)):
                subvol.VolumeMesh(CUBE_POINTS, hexes=CUBE, **arrays)
        with self.assertRaises(TypeError):
            subvol.SurfaceMesh(CUBE_POINTS, quads=[FLOOR], face_groups=[0], group_names="a")

    def test_a_fit_carries_them(self):
        boundary = grouped_cube().boundary()
        target = subvol.SurfaceMesh(boundary.points, face_points=boundary.face_points,
                                    face_offsets=boundary.face_offsets, face_groups=boundary.face_groups,
                                    group_names=["floor", "roof"])
        result = subvol.fit(target, subvol.VolumeMesh(CUBE_POINTS, hexes=CUBE), levels=1, max_iterations=2,
                            surface="mesh", cage_only=True)
        self.assertEqual([group["name"] for group in result.report["groups"]], ["floor", "roof"])
        self.assertEqual(result.report["groups"][0]["faces"], 4)
        self.assertEqual(len(result.mesh.grouped_faces), 8)


if __name__ == "__main__":
    unittest.main()
