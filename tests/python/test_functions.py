# SPDX-License-Identifier: GPL-3.0-or-later
import contextlib
import os
import unittest

import numpy as np

import subvol
from common import CUBE, CUBE_POINTS, InFolder, cube, decimal_comma


def times(matrix, points):
    """A matrix given by its three arrays, times points; as SciPy would."""
    rows = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    result = np.zeros((matrix.shape[0], 3))
    np.add.at(result, rows, matrix.data[:, None] * points[matrix.indices])
    return result


class Subdivision(InFolder):
    def test_the_matrix_makes_the_fine_points(self):
        for options in ({}, {"levels": 2}, {"boundary": "averaging"}, {"boundary": "linear", "levels": 2},
                        {"crease_angle": 40, "levels": 2}, {"levels": 0}):
            mesh = subvol.read("torus_template.mesh")
            fine, matrix = subvol.subdivide(mesh, **options), subvol.subdivision_matrix(mesh, **options)
            self.assertEqual(len(fine.hexes), 60 * 8 ** options.get("levels", 1))
            self.assertEqual(matrix.shape, (len(fine.points), len(mesh.points)))
            np.testing.assert_allclose(times(matrix, mesh.points), fine.points, atol=1e-12)
            np.testing.assert_allclose(matrix.apply(mesh.points), fine.points, atol=1e-12)
            np.testing.assert_allclose(np.add.reduceat(matrix.data, matrix.indptr[:-1]), 1, atol=1e-12)

    def test_the_matrix_is_views_that_live(self):
        indptr = subvol.subdivision_matrix(cube()).indptr
        self.assertEqual((indptr.dtype, indptr[0], len(indptr)), (np.int64, 0, 28))
        matrix = subvol.subdivision_matrix(cube())
        self.assertTrue(np.shares_memory(matrix.data, matrix.data))
        self.assertEqual((matrix.data.dtype, matrix.indices.dtype), (np.float64, np.int32))

    def test_the_transpose(self):
        matrix = subvol.subdivision_matrix(cube())
        points = np.random.default_rng(7).random((27, 3))
        dense = np.zeros(matrix.shape)
        for row in range(27):
            part = slice(matrix.indptr[row], matrix.indptr[row + 1])
            dense[row, matrix.indices[part]] = matrix.data[part]
        np.testing.assert_allclose(matrix.apply_transposed(points), dense.T @ points, atol=1e-14)
        with self.assertRaisesRegex(subvol.InputError, "points must have 8 rows, not 27"):
            matrix.apply(points)

    def test_the_limit_surface(self):
        limit = subvol.limit_surface("torus_template.mesh", chord=0.1)
        self.assertGreater(len(limit.quads), 100)
        cage = subvol.read("torus_template.mesh")
        cage.points[:] = subvol.limit_matrix(cage).apply(cage.points)
        distances = [np.linalg.norm(limit.points - point, axis=1).min() for point in cage.boundary().points]
        self.assertLess(max(distances), 1e-12)
        finer = subvol.limit_surface("torus_template.mesh", chord=0.01)
        self.assertLess(subvol.distance(limit, finer)["max_percent"], 0.15)

    def test_levels_out_of_range(self):
        for levels in (-1, 9):
            with self.assertRaisesRegex(subvol.InputError, "levels must be in"):
                subvol.subdivide(cube(), levels=levels)


class Filling(InFolder):
    def test_a_surface_is_filled_as_with_the_program(self):
        result = subvol.fill("ball_target.off", cells=800, max_iterations=4)
        self.assertTrue(result.report["valid"])
        self.assertGreater(len(result.mesh.hexes), 0)
        self.assertEqual(result.report["template"]["trials"][result.report["template"]["chosen"]]["cells"],
                         len(result.mesh.hexes))
        subvol.write("b.mesh", result)
        self.run_program("fit", "ball_target.off", "--cells", "800", "--max-iterations", "4", "-o", "a.mesh")
        self.assert_same_file("a.mesh", "b.mesh")

    def test_a_cage_is_made_as_with_the_program(self):
        result = subvol.fill("ball_target.off", cells=1600, cage=True, max_iterations=3)
        self.assertEqual(8 * len(result.cage.hexes), len(result.mesh.hexes))
        self.assertIn("max_percent", result.report["limit_surface_distance"])
        subvol.write("b.mesh", result.cage)
        self.run_program("fit", "ball_target.off", "--cells", "1600", "--max-iterations", "3", "-o", "cage:a.mesh")
        self.assert_same_file("a.mesh", "b.mesh")
        self.assertIsNone(subvol.fill("ball_target.off", cells=100, max_iterations=1).cage)

    def test_messages_name_keywords(self):
        curved = subvol.fit("ball_target.off", "ball_template.mesh", order=2, max_iterations=1).mesh
        subvol.write("curved.msh", curved)
        with self.assertRaisesRegex(subvol.InputError, "`fit order` read"):
            subvol.fit("ball_target.off", "curved.msh")

    def test_options_out_of_range(self):
        with self.assertRaisesRegex(subvol.InputError, "quality must be in"):
            subvol.fill("ball_target.off", quality=0.95)
        with self.assertRaisesRegex(subvol.InputError, "cells must be in"):
            subvol.fill("ball_target.off", cells=2)


class Optimizing(InFolder):
    def test_a_tangled_mesh_becomes_valid_as_with_the_program(self):
        mesh = subvol.template.grid(box=[0, 0, 0, 1, 1, 1], counts=[2, 2, 2])
        mesh.points[13] = [1.2, 0.5, 0.5]
        self.assertFalse(subvol.check(mesh)["valid"])
        subvol.write("tangled.mesh", mesh)
        result = subvol.optimize(mesh)
        self.assertTrue(result.report["valid"])
        self.assertGreater(result.report["input"]["quality"]["inverted_cells"], 0)
        self.run_program("optimize", "tangled.mesh", "-o", "a.mesh")
        subvol.write("b.mesh", result)
        self.assert_same_file("a.mesh", "b.mesh")

    def test_curving_as_with_the_program(self):
        self.run_program("optimize", "ball_template.mesh", "--target", "ball_target.off", "--order", "2",
                         "--tolerance", "2", "-o", "a.vtu")
        result = subvol.optimize("ball_template.mesh", target="ball_target.off", order=2, tolerance=2)
        subvol.write("b.vtu", result)
        self.assert_same_file("a.vtu", "b.vtu")

    def test_options_that_do_not_go_together(self):
        with self.assertRaisesRegex(subvol.InputError, "order needs a target"):
            subvol.optimize(cube(), order=2)
        with self.assertRaisesRegex(subvol.InputError, r"order must be in \[2, 16\]"):
            subvol.optimize(cube(), order=1, target=cube())
        with self.assertRaisesRegex(subvol.InputError, "sizes does not go with order"):
            subvol.optimize(cube(), order=2, target=cube(), sizes="local")


class Shells(InFolder):
    def test_a_shell_is_the_programs_bit_by_bit(self):
        self.run_program("shell", "ball_template.mesh", "--thickness", "3%", "--layers", "2", "--side", "both",
                         "-o", "a.mesh")
        result = subvol.shell("ball_template.mesh", "3%", layers=2, side="both")
        subvol.write("b.mesh", result)
        self.assert_same_file("a.mesh", "b.mesh")
        n = len(result.mesh.points) // 5
        self.assertEqual((result.thickness.shape, result.inside_layers), ((2, n), 2))
        np.testing.assert_array_equal(np.unique(result.mesh.references), [1, 2, 3, 4])
        self.assertTrue(result.report["valid"])
        self.assertTrue(np.all(result.thickness > 0))
        self.assertTrue(np.all(result.thickness_limited <= result.thickness_asked))

    def test_faces_that_point_inward_are_told(self):
        turned = cube().boundary()
        turned = subvol.SurfaceMesh(turned.points, quads=turned.quads[:, ::-1])
        with self.assertWarnsRegex(UserWarning, "point inward"):
            report = subvol.shell(turned, 0.1, straight=True).report
        self.assertTrue(any("point inward" in warning for warning in report["warnings"]))

    def test_a_shell_of_one_region(self):
        grid = subvol.template.grid(box=(0, 0, 0, 2, 1, 1), counts=(2, 1, 1))
        two = subvol.VolumeMesh(grid.points, hexes=grid.hexes, references=[3, 8])
        result = subvol.shell(two, 0.1, region=8, side="inward")
        self.assertEqual(len(result.surface.quads), 6)
        with self.assertRaisesRegex(ValueError, "region"):
            subvol.shell(two, 0.1, region=7)

    def test_a_curved_shell(self):
        surface = cube().boundary()
        result = subvol.shell(surface, np.full(8, 0.1), order=2)
        self.assertEqual(result.mesh.order, 2)
        self.assertEqual(len(result.linear_mesh.hexes), 6)
        np.testing.assert_array_equal(result.mesh.coefficients[:8], surface.points)
        for name in ("s.glb", "s.vtu", "s.msh", "s.obj", "cage:s.usda"):
            subvol.write(name, result)
        view = result.linear_mesh.points
        del result
        np.testing.assert_array_equal(view[:8], surface.points)

    def test_options_of_curved_cells_go_with_order(self):
        with self.assertRaisesRegex(subvol.InputError, "basis goes with order only"):
            subvol.shell(cube().boundary(), 0.1, basis="fourier")

    def test_a_thickness_that_makes_no_sense(self):
        for thickness in ("two", "-1%", 0, -1.0, float("nan"), [0.1, 0.2], np.full(8, -1.0)):
            with self.assertRaises(subvol.InputError, msg=str(thickness)):
                subvol.shell(cube().boundary(), thickness)
        for thickness in (None, ["a"] * 8, True, np.bool_(True)):
            with self.assertRaises(TypeError, msg=str(thickness)):
                subvol.shell(cube().boundary(), thickness)
        with self.assertRaises(subvol.InputError):
            subvol.shell(cube().boundary(), 0.1, layers=10**9)
        for options in ({"layers": 0}, {"layers": 1001}, {"growth": 0.001}, {"growth": 101.0}):
            with self.assertRaises(subvol.InputError, msg=str(options)):
                subvol.shell(cube().boundary(), 0.1, **options)

    def test_a_thickness_may_be_a_number_of_numpy(self):
        for thickness in (np.float32(0.25), np.float64(0.25), np.array(0.25), np.full(8, 0.25), np.int64(1), 1):
            result = subvol.shell(cube().boundary(), thickness, straight=True)
            self.assertEqual(len(result.linear_mesh.hexes), 6, msg=repr(thickness))

    def test_a_chord_out_of_range_is_refused_before_the_work(self):
        began = []
        for chord in (0, -1, float("nan"), 1000):
            for work in (lambda **o: subvol.fit("torus_target.off", "torus_template.mesh", order=2, **o),
                         lambda **o: subvol.fill("torus_target.off", **o),
                         lambda **o: subvol.optimize(cube(), target=cube(), order=2, **o),
                         lambda **o: subvol.shell(cube().boundary(), 0.1, **o)):
                with self.assertRaisesRegex(subvol.InputError, "chord must be in"):
                    work(chord=chord, progress=lambda p: began.append(p))
        self.assertEqual(began, [])

    def test_a_coefficient_that_is_not_finite_is_a_defect(self):
        mesh = subvol.HighOrderMesh(cube(), 2)
        mesh.coefficients[10] = np.nan
        report = subvol.check(mesh)
        self.assertFalse(report["valid"])
        self.assertIn("not_finite", [defect["kind"] for defect in report["defects"]])


class Curved(unittest.TestCase):
    def test_points_of_curved_cells(self):
        mesh = subvol.HighOrderMesh(cube(), 3, basis="legendre")
        self.assertEqual(mesh.coefficients.shape, (64, 3))
        np.testing.assert_array_equal(mesh.cell_orders, [3])
        self.assertEqual((len(mesh.edge_orders), len(mesh.face_orders)), (12, 6))
        places = np.random.default_rng(3).random((20, 3))
        cells = np.zeros(20, int)
        np.testing.assert_allclose(mesh.evaluate(cells, places), places, atol=1e-14)
        mesh.coefficients[63] = [0.1, 0, 0]
        moved = mesh.evaluate(cells, places)
        self.assertGreater(np.abs(moved - places).max(), 1e-4)
        np.testing.assert_allclose(mesh.point_map(cells, places).apply(mesh.coefficients), moved, atol=1e-14)
        self.assertEqual(len(mesh.linear_cells(3).hexes), 27)
        self.assertTrue(subvol.check(mesh)["valid"])
        self.assertEqual(subvol.check(mesh)["orders"]["max"], 3)
        self.assertEqual(mesh.straight_sided().hexes.tolist(), CUBE.tolist())
        self.assertGreaterEqual(len(mesh.boundary().triangles), 12)

    def test_what_is_refused(self):
        with self.assertRaises(subvol.InputError):
            subvol.HighOrderMesh(cube(), 17)
        with self.assertRaisesRegex(subvol.InputError, "cells\\[0\\] is 1"):
            subvol.HighOrderMesh(cube(), 2).evaluate([1], [[0, 0, 0]])
        with self.assertRaises(subvol.InputError):
            subvol.HighOrderMesh(cube(), 2).evaluate([0], [[0, 0, np.nan]])
        with self.assertRaises(subvol.InputError):
            subvol.HighOrderMesh(cube(), 2).evaluate([0, 0], [[0, 0, 0]])


class Templates(InFolder):
    def test_the_verbs(self):
        grid = subvol.template.grid(box=[0, 0, 0, 3, 2, 1], counts=(3, 2, 1))
        self.assertEqual(len(grid.hexes), 6)
        self.assertEqual(len(subvol.template.grid("ball_target.off", size=0.5).hexes), len(
            subvol.template.grid(subvol.read("ball_target.off"), size=0.5).hexes))
        self.assertEqual(len(subvol.template.carve(grid, list=[0, 1]).hexes), 2)
        self.assertEqual(len(subvol.template.carve(grid, list=[0], invert=True).hexes), 5)
        self.assertEqual(len(subvol.template.carve(grid, box=(0, 0, 0, 1, 2, 1)).hexes), 2)
        self.assertEqual(len(subvol.template.refine(grid, list=range(6)).hexes), 6 * 27)
        self.assertEqual(len(subvol.template.refine(grid, thin=True).hexes), 6 * 27)
        inside = subvol.template.carve(subvol.template.grid("ball_target.off", size=0.4), inside="ball_target.off")
        self.assertGreater(len(inside.hexes), 8)
        self.assertGreater(len(subvol.template.pillow(grid).hexes), 6)
        self.assertEqual(len(subvol.template.pillow(cube()).hexes), 7)
        self.assertEqual(len(subvol.template.split(cube(), edge=(0, 1), parts=3).hexes), 3)
        self.assertEqual(len(subvol.template.split(cube(), into="prisms", edge=(0, 1)).prisms), 2)
        halves = subvol.template.split(cube(), edge=(0, 1))
        self.assertEqual(len(subvol.template.collapse(halves, vertices=(0, 8)).hexes), 1)
        two = subvol.template.merge(cube(), subvol.VolumeMesh(CUBE_POINTS + [1, 0, 0], hexes=CUBE))
        self.assertEqual((len(two.points), len(two.hexes)), (12, 2))
        stacked = subvol.template.extrude(cube().boundary(), thickness=0.1, layers=2)
        self.assertEqual(len(stacked.hexes), 12)
        made = subvol.template.auto("ball_target.off", cells=30)
        self.assertTrue(subvol.check(made)["valid"])

    def test_what_is_refused(self):
        template = subvol.template
        for call in (lambda: template.grid(counts=(1, 1, 1)), lambda: template.grid(box=(0, 0, 0, 1, 1, 1)),
                     lambda: template.grid(box=(0, 0, 0, 1, 1, 0), size=1), lambda: template.carve(cube()),
                     lambda: template.refine(cube()),
                     lambda: template.carve(cube(), list=[1]), lambda: template.carve(cube(), list=[0], box=range(6)),
                     lambda: template.pillow(cube(), list=[]), lambda: template.collapse(cube()),
                     lambda: template.collapse(cube(), vertices=(0, 99)), lambda: template.split(cube()),
                     lambda: template.split(cube(), edge=(0, -5)), lambda: template.auto(cube().boundary(), cells=1),
                     lambda: template.extrude(cube().boundary(), thickness=0),
                     lambda: template.merge(cube(), tolerance=float("nan")),
                     lambda: template.extrude(cube().boundary(), thickness=1, layers=10**9)):
            with self.assertRaises(subvol.InputError):
                call()
        for call in (lambda: template.grid(box=(0, 0, 1), size=1), lambda: template.grid(box="abcdef", size=1),
                     lambda: template.grid(box=(0, 0, 0, 1, 1, 1), counts=(1, 1, 1.5))):
            with self.assertRaises(TypeError):
                call()


class Checks(InFolder):
    def test_what_is_true_of_a_mesh(self):
        found = subvol.check(cube(), cube())
        self.assertTrue(found["valid"])
        self.assertLess(found["distance"]["max"], 1e-15)
        np.testing.assert_array_equal(found["cell_scaled_jacobian"], [1])
        self.assertEqual(len(found["not_certified_cells"]), 0)
        inverted = subvol.VolumeMesh(CUBE_POINTS, hexes=CUBE[:, [4, 5, 6, 7, 0, 1, 2, 3]])
        found = subvol.check(inverted)
        self.assertFalse(found["valid"])
        np.testing.assert_array_equal(found["not_certified_cells"], [0])
        self.assertLess(found["cell_scaled_jacobian"][0], 0)

    def test_a_check_tells_its_parts_and_ends_between_them(self):
        told = []
        subvol.check("torus_template.mesh", "torus_target.off", progress=lambda p: told.append((p.stage, p.fraction)))
        self.assertEqual([stage for stage, _ in told], ["quality", "topology", "self-intersections", "distance"])
        self.assertEqual(sorted(told, key=lambda t: t[1]), told)
        part = subvol.check("torus_template.mesh", progress=lambda p: p.stage != "topology")
        self.assertIn("quality", part)
        self.assertFalse(part["valid"])

    def test_anything_may_be_wrong_with_a_mesh(self):
        for cells in ([[0] * 8], [[0, 1, 2, 3, 4, 5, 6, 6]], [range(8), range(8)], np.empty((0, 8), int)):
            mesh = subvol.VolumeMesh(CUBE_POINTS, hexes=cells, creases=[[0, 6], [2, 2]],
                                     corners=[1], corner_sharpness=[-1])
            self.assertFalse(subvol.check(mesh)["valid"])
            for work in (subvol.subdivide, subvol.limit_surface, subvol.optimize, subvol.template.pillow,
                         lambda m: subvol.HighOrderMesh(m, 2)):
                with self.assertRaises(subvol.InputError):
                    work(mesh)

    def test_self_intersections_and_distance(self):
        self.assertEqual(subvol.self_intersections(cube()).shape, (0, 2))
        crossing = subvol.SurfaceMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.2, -1], [0.2, 0.2, 1], [0.3, 0.1, 1]],
                                      [[0, 1, 2], [3, 4, 5]])
        np.testing.assert_array_equal(subvol.self_intersections(crossing), [[0, 1]])
        shifted = subvol.VolumeMesh(CUBE_POINTS + [0.1, 0, 0], hexes=CUBE)
        self.assertAlmostEqual(subvol.distance(cube(), shifted, samples=1000)["max"], 0.1)

    def test_everything_can_be_written(self):
        fit = subvol.fit("ball_target.off", "ball_template.mesh", levels=1)
        curved = subvol.HighOrderMesh(cube(), 2)
        for i, (what, names) in enumerate((
                (fit, "mesh vtk vtu msh glb gltf obj usda"), (fit.cage, "usda glb"),
                (curved, "vtu msh mesh vtk glb obj"))):
            for extension in names.split():
                name = f"{i}.{extension}"
                subvol.write(name, what, chord=0.1, unit=0.01, up="z")
                self.assertGreater(os.path.getsize(name), 100, name)
        subvol.write("limit.glb", fit.cage, limit=True, chord=0.1)
        subvol.write("fine.mesh", curved, intervals=3)
        self.assertEqual(len(subvol.read("fine.mesh").hexes), 27)
        with self.assertRaisesRegex(subvol.InputError, "there is no cage here"):
            subvol.write("cage:x.mesh", cube())
        with self.assertRaisesRegex(subvol.InputError, "subdivision cages"):
            subvol.write("x.usda", curved)
        with self.assertRaises(subvol.InputError):
            subvol.write("x.glb", cube(), unit=float("nan"))
        self.assertFalse(os.path.exists("x.glb"))


class Locales(InFolder):
    """Programs that set their user's locale get what others do."""

    def assert_same(self, work):
        """work() returns the same with a decimal comma."""
        result = work()
        with decimal_comma():
            self.assertEqual(work(), result)
        return result

    def written(self, name, mesh, **options):
        subvol.write(name, mesh, **options)
        with open(name.split(":")[-1], "rb") as file:
            return file.read()

    def test_words_that_hold_numbers(self):
        for thickness in ("2.5%", "0.05"):
            self.assert_same(lambda: subvol.shell("bowl.obj", thickness, straight=True).mesh.points.tolist())
        cut = {place: self.assert_same(lambda: self.written("cutaway:a.glb", self.grid(), cut=place))
               for place in ("x:0.2", "x:0.6")}
        self.assertNotEqual(cut["x:0.2"], cut["x:0.6"])

    def test_what_is_said(self):
        def said():
            with self.assertRaises(subvol.InputError) as caught:
                subvol.fit("ball_target.off", "ball_template.mesh", tolerance=-0.5)
            report = subvol.fit("ball_target.off", "ball_template.mesh", levels=1).report
            return str(caught.exception), report["explanation"], [stage["name"] for stage in report["stages"]]

        self.assertIn("-0.5", self.assert_same(said)[0])

    def test_checkpoints(self):
        for options in (dict(levels=1), dict(order=2)):
            given = dict(target="ball_target.off", template="ball_template.mesh", max_iterations=2, **options)
            for first, then in ((decimal_comma, contextlib.nullcontext), (contextlib.nullcontext, decimal_comma)):
                with first():
                    report = subvol.fit(**given, checkpoint="ball.checkpoint").report
                with then():
                    again = subvol.fit(**given, resume="ball.checkpoint").report
                self.assertEqual(again["recalled_stages"], len(report["stages"]))

    def grid(self):
        grid = subvol.template.grid(box=[0, 0, 0, 4, 1, 1], counts=[4, 2, 2])
        grid.points[:] /= 3
        return grid

    def test_files(self):
        names = [f"a.{extension}" for extension in "mesh vtk vtu msh glb gltf obj usda".split()]
        for name in names:
            self.assert_same(lambda: self.written(name, self.grid(), unit=0.01))
        for name in ("a.vtu", "a.msh"):
            self.assert_same(lambda: self.written(name, subvol.HighOrderMesh(self.grid(), 2)))
        for name in ("a.mesh", "a.vtk", "a.obj"):
            self.assert_same(lambda: subvol.read(name).points.tolist())
        self.assert_same(lambda: subvol.read("a.vtu").coefficients.tolist())


if __name__ == "__main__":
    unittest.main()
