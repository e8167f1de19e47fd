# SPDX-License-Identifier: GPL-3.0-or-later
import gc
import os
import unittest
import weakref

import numpy as np

import subvol
from common import CUBE, CUBE_POINTS, InFolder, cube

MIXED = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1],
         [2, 0, 0], [2, 0, 1], [3, 0, 0]]


class VolumeMeshes(unittest.TestCase):
    def test_arrays_come_out_as_they_went_in(self):
        mesh = subvol.VolumeMesh(MIXED, hexes=[[0, 1, 2, 3, 4, 5, 6, 7]], prisms=[[1, 8, 2, 5, 9, 6]],
                                 tets=[[8, 10, 2, 9]], references=[3, 1, -2], creases=[[1, 0], [4, 5]],
                                 crease_sharpness=[2.5, 10],
                                 corners=[7], corner_sharpness=[1.5])
        self.assertEqual(mesh.points.dtype, np.float64)
        np.testing.assert_array_equal(mesh.points, MIXED)
        np.testing.assert_array_equal(mesh.hexes, CUBE)
        np.testing.assert_array_equal(mesh.prisms, [[1, 8, 2, 5, 9, 6]])
        np.testing.assert_array_equal(mesh.tets, [[8, 10, 2, 9]])
        np.testing.assert_array_equal(mesh.kinds, [subvol.HEX, subvol.PRISM, subvol.TET])
        np.testing.assert_array_equal(mesh.cell_offsets, [0, 8, 14, 18])
        np.testing.assert_array_equal(mesh.references, [3, 1, -2])
        np.testing.assert_array_equal(mesh.creases, [[0, 1], [4, 5]])
        np.testing.assert_array_equal(mesh.crease_sharpness, [2.5, 10])
        np.testing.assert_array_equal(mesh.corners, [7])
        np.testing.assert_array_equal(mesh.corner_sharpness, [1.5])
        self.assertEqual(repr(mesh), "<subvol.VolumeMesh: 11 points, 1 hexes, 1 prisms, 1 tets>")

    def test_what_is_not_there_is_empty(self):
        mesh = subvol.VolumeMesh(np.empty((0, 3)))
        self.assertEqual(mesh.points.shape, (0, 3))
        self.assertEqual(mesh.hexes.shape, (0, 8))
        self.assertEqual(mesh.creases.shape, (0, 2))
        self.assertEqual(mesh.references.shape, (0,))
        self.assertFalse(subvol.check(mesh)["valid"])

    def test_arrays_are_views(self):
        mesh = cube()
        for name in ("points", "hexes", "kinds", "cell_points", "cell_offsets"):
            self.assertTrue(np.shares_memory(getattr(mesh, name), getattr(mesh, name)), name)
        self.assertTrue(np.shares_memory(mesh.hexes, mesh.cell_points))
        mesh.points[:, 2] *= 2
        self.assertEqual(mesh.points[4, 2], 2)
        self.assertAlmostEqual(subvol.check(mesh)["volume"], 2)
        copy = mesh.copy()
        self.assertFalse(np.shares_memory(copy.points, mesh.points))
        np.testing.assert_array_equal(copy.points, mesh.points)

    def test_given_arrays_are_copied(self):
        points = CUBE_POINTS.copy()
        mesh = subvol.VolumeMesh(points, hexes=CUBE)
        points[:] = 0
        self.assertEqual(mesh.points[6, 0], 1)

    def test_only_points_can_be_written(self):
        mesh = subvol.VolumeMesh(CUBE_POINTS, hexes=CUBE, creases=[[0, 1]], references=[4])
        for name in ("hexes", "kinds", "cell_points", "cell_offsets", "references", "creases", "crease_sharpness"):
            array = getattr(mesh, name)
            self.assertFalse(array.flags.writeable, name)
            with self.assertRaises(ValueError):
                array.flags.writeable = True

    def test_views_keep_the_mesh(self):
        mesh = cube()
        points, hexes, row = mesh.points, mesh.hexes, mesh.points[6]
        gone = weakref.ref(mesh)
        del mesh
        gc.collect()
        filler = [cube() for _ in range(1000)]
        np.testing.assert_array_equal(points, CUBE_POINTS)
        np.testing.assert_array_equal(hexes, CUBE)
        np.testing.assert_array_equal(row, [1, 1, 1])
        del points, hexes, row, filler
        gc.collect()
        self.assertIsNone(gone())

    def test_any_numbers_do(self):
        strided = np.zeros((8, 6), np.float32)
        strided[:, ::2] = CUBE_POINTS
        for points in (CUBE_POINTS.astype(int), CUBE_POINTS.tolist(), strided[:, ::2], np.asfortranarray(CUBE_POINTS)):
            np.testing.assert_array_equal(subvol.VolumeMesh(points, hexes=CUBE.astype(np.uint64)).points, CUBE_POINTS)

    def test_arrays_that_do_not_fit_are_refused(self):
        def refused(error, text, points=CUBE_POINTS, **arrays):
            with self.assertRaises(error) as caught:
                subvol.VolumeMesh(points, **arrays)
            self.assertIn(text, str(caught.exception))

        refused(subvol.InputError, "points must have the shape (n, 3), not (8, 2)", points=CUBE_POINTS[:, :2])
        refused(subvol.InputError, "hexes must have the shape (n, 8), not (8,)", hexes=CUBE[0])
        refused(subvol.InputError, "hexes[0, 7] is 8, but must be in [0, 8)", hexes=CUBE + 1)
        refused(subvol.InputError, "hexes[0, 0] is -1", hexes=CUBE - 1)
        refused(subvol.InputError, "tets[0, 1] is 99", tets=[[0, 99, 1, 2]])
        refused(subvol.InputError, "references must have 1 entries, not 2", hexes=CUBE, references=[1, 2])
        refused(subvol.InputError, "creases[0, 1] is 9", hexes=CUBE, creases=[[0, 9]])
        refused(subvol.InputError, "crease_sharpness must have 1 entries", creases=[[0, 1]], crease_sharpness=[1, 2])
        refused(TypeError, "hexes must be an array of whole numbers, not of float64", hexes=CUBE.astype(float))
        refused(TypeError, "points must be an array of numbers", points=[["a", "b", "c"]])
        refused(TypeError, "there is no option 'cubes'; there are hexes, prisms, tets", cubes=CUBE)
        with self.assertRaises(TypeError):
            subvol.VolumeMesh()

    def test_cells_that_do_not_follow_one_another_are_gathered(self):
        mesh = subvol.template.merge(subvol.template.split(cube(), into="tets"),
                                     subvol.VolumeMesh(CUBE_POINTS + [5, 0, 0], hexes=CUBE))
        both = subvol.template.merge(mesh, subvol.template.split(subvol.VolumeMesh(CUBE_POINTS + [9, 0, 0], hexes=CUBE),
                                                                 into="tets"))
        self.assertGreater(len(both.tets), len(mesh.tets))
        np.testing.assert_array_equal(both.kinds[: len(mesh.tets)], subvol.TET)
        np.testing.assert_array_equal(both.tets, np.concatenate(
            [both.cell_points[a : a + 4] for a, kind in zip(both.cell_offsets, both.kinds) if kind == subvol.TET]
        ).reshape(-1, 4))


class SurfaceMeshes(InFolder):
    def test_faces_come_out_as_they_went_in(self):
        points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]]
        mesh = subvol.SurfaceMesh(points, [[1, 4, 2]], [[0, 1, 2, 3]], creases=[[2, 1]])
        np.testing.assert_array_equal(mesh.triangles, [[1, 4, 2]])
        np.testing.assert_array_equal(mesh.quads, [[0, 1, 2, 3]])
        np.testing.assert_array_equal(mesh.face_offsets, [0, 3, 7])
        np.testing.assert_array_equal(mesh.creases, [[1, 2]])
        same = subvol.SurfaceMesh(points, face_points=mesh.face_points, face_offsets=mesh.face_offsets)
        np.testing.assert_array_equal(same.quads, mesh.quads)
        self.assertTrue(np.shares_memory(same.quads, same.face_points))
        self.assertEqual(mesh.triangulated().triangles.shape, (3, 3))

    def test_faces_that_do_not_fit_are_refused(self):
        for offsets in ([0, 3], [1, 4], [0, 2, 4], []):
            with self.assertRaisesRegex(subvol.InputError, "face_offsets"):
                subvol.SurfaceMesh(CUBE_POINTS, face_points=[0, 1, 2, 3], face_offsets=offsets)
        with self.assertRaisesRegex(subvol.InputError, "go together"):
            subvol.SurfaceMesh(CUBE_POINTS, face_points=[0, 1, 2])

    def test_the_boundary_of_a_mesh_has_its_tags(self):
        boundary = subvol.VolumeMesh(CUBE_POINTS, hexes=CUBE, creases=[[0, 1]], corners=[6]).boundary()
        self.assertEqual(boundary.quads.shape, (6, 4))
        np.testing.assert_array_equal(boundary.creases, [[0, 1]])
        np.testing.assert_array_equal(boundary.corners, [6])

    def test_tags_off_the_boundary_are_left_out(self):
        grid = subvol.template.grid(box=[0, 0, 0, 2, 2, 2], counts=[2, 2, 2])
        center = 13
        np.testing.assert_array_equal(grid.points[center], [1, 1, 1])
        mesh = subvol.VolumeMesh(grid.points, hexes=grid.hexes, creases=[[4, center], [25, 26]], corners=[center, 14])
        boundary = mesh.boundary()
        np.testing.assert_array_equal(boundary.points[boundary.corners], grid.points[[14]])
        np.testing.assert_array_equal(boundary.points[boundary.creases], [grid.points[[25, 26]]])
        subvol.write("tags.usda", mesh)
        with open("tags.usda") as file:
            text = file.read()
        self.assertIn(f"cornerIndices = {boundary.corners.tolist()}", text)
        self.assertIn(f"creaseIndices = {boundary.creases[0].tolist()}", text)

    def test_files(self):
        surface = subvol.read("torus_target.off")
        self.assertIsInstance(surface, subvol.SurfaceMesh)
        mesh = subvol.read("torus_template.mesh")
        self.assertEqual(mesh.hexes.shape, (60, 8))
        subvol.write("again.mesh", mesh)
        np.testing.assert_array_equal(subvol.read("again.mesh").points, mesh.points)
        for name in ("a.obj", "a.glb", "a.usda", "a.gltf"):
            subvol.write(name, surface)
        for name in ("b.vtk", "b.vtu", "b.msh", "b.obj", "b.glb", "b.usda", "b.mesh"):
            subvol.write(name, mesh)
        np.testing.assert_array_equal(subvol.read("a.obj").triangles, surface.triangles)

    def test_files_that_cannot_be_used(self):
        with open("torn.mesh", "w") as file:
            file.write("MeshVersionFormatted 2\nDimension 3\nVertices 2\n0 0 0 0\n")
        with self.assertRaisesRegex(subvol.InputError, "torn.mesh"):
            subvol.read("torn.mesh")
        with self.assertRaisesRegex(subvol.Error, "nowhere.off"):
            subvol.read("nowhere.off")
        with self.assertRaisesRegex(subvol.InputError, "unknown"):
            subvol.read("what.abc")
        with self.assertRaisesRegex(subvol.InputError, "holds points without faces"):
            subvol.read("what.xyz")
        with self.assertRaisesRegex(subvol.InputError, "extension"):
            subvol.write("what.xyz", cube())
        with self.assertRaises(OSError) as caught:
            subvol.write("nowhere/cube.mesh", cube())
        self.assertIsInstance(caught.exception, subvol.IoError)
        with self.assertRaisesRegex(subvol.InputError, "holds cells"):
            subvol.write("surface.msh", subvol.read("torus_target.off"))
        with self.assertRaisesRegex(TypeError, "expected a mesh or a result, not ndarray"):
            subvol.write("points.mesh", CUBE_POINTS)
        with self.assertRaisesRegex(TypeError, "there is no option 'color'"):
            subvol.write("cube.glb", cube(), color="red")

    def test_points_that_are_not_finite_are_refused(self):
        mesh = cube()
        mesh.points[3, 1] = np.nan
        self.assertIn("not_finite", [defect["kind"] for defect in subvol.check(mesh)["defects"]])
        for name in ("a.mesh", "a.vtk", "a.vtu", "a.msh", "a.glb", "a.obj", "a.usda"):
            with self.assertRaises(subvol.InputError, msg=name):
                subvol.write(name, mesh)
        for work in (subvol.subdivide, subvol.limit_surface, subvol.optimize, subvol.template.pillow,
                     lambda m: subvol.fit("torus_target.off", m), lambda m: subvol.shell(m, 0.1)):
            with self.assertRaises(subvol.InputError):
                work(mesh)

    def test_warnings_are_told(self):
        with open("twice.off", "w") as file:
            file.write("OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n5 5 5\n3 0 1 2\n3 0 0 1\n")
        with self.assertWarnsRegex(UserWarning, "twice.off"):
            subvol.read("twice.off")

    def test_names_of_files_need_not_be_utf_8(self):
        with open(b"caf\xe9.off", "w") as file:
            file.write("OFF\n4 1 0\n0 0 0\n1 0 0\n0 1 0\n5 5 5\n3 0 1 2\n")
        for name in (b"caf\xe9.off", os.fsdecode(b"caf\xe9.off")):
            with self.assertWarnsRegex(UserWarning, "caf\ufffd.off.*vert"):
                self.assertEqual(len(subvol.read(name).triangles), 1)
        with self.assertRaisesRegex(subvol.InputError, "no\ufffd.off: no such file"):
            subvol.read(b"no\xe9.off")
        with self.assertRaisesRegex(subvol.InputError, "what\ufffd.xyz"):
            subvol.write(b"what\xe9.xyz", cube())
        with self.assertRaisesRegex(subvol.IoError, "nowhere\ufffd"):
            subvol.write(b"nowhere\xe9/cube.mesh", cube())
        for extension in "mesh vtk vtu msh glb gltf obj usda".split():
            subvol.write(b"caf\xe9." + extension.encode(), cube())


class Views(InFolder):
    def test_meshes_are_shown(self):
        try:
            view = cube().show(title="a cube")
        except RuntimeError as error:
            self.assertIn("npm", str(error))  # built without node
            self.assertIsNone(cube()._repr_html_())
            return
        self.assertIn("a cube", view.html)
        self.assertTrue(view.html.startswith("<!DOCTYPE html>"))
        view.save("cube.html")
        with open("cube.html", encoding="utf-8") as file:
            self.assertEqual(file.read(), view.html)
        for mesh in (cube(), cube().boundary(), subvol.HighOrderMesh(cube(), 2)):
            self.assertTrue(mesh._repr_html_().startswith("<iframe"))
        self.assertIn("distance", subvol.read("torus_template.mesh").show("torus_target.off").html)
        self.assertIn("shows_limit", cube().show(limit=True).html)
        with self.assertRaises(subvol.InputError):
            cube().boundary().show(limit=True)
        empty = subvol.VolumeMesh(CUBE_POINTS)
        with self.assertRaises(subvol.InputError):
            empty.show()
        self.assertIsNone(empty._repr_html_())


if __name__ == "__main__":
    unittest.main()
