# SPDX-License-Identifier: GPL-3.0-or-later
import inspect
import os
import signal
import threading
import time
import unittest

import numpy as np

import subvol
from common import CUBE, CUBE_POINTS, InFolder, cube

BALL = ("ball_target.off", "ball_template.mesh")


class Fits(InFolder):
    def test_a_fit_returns_arrays_and_a_report(self):
        fit = subvol.fit(*BALL, levels=1)
        self.assertEqual(fit.mesh.points.shape[1], 3)
        self.assertEqual(fit.mesh.hexes.shape, (56, 8))
        self.assertEqual(fit.cage.hexes.shape, fit.template.hexes.shape)
        report = fit.report
        self.assertEqual((report["stop_reason"], report["valid"]), ("converged", True))
        self.assertEqual(report["quality"]["certified_cells"], 56)
        self.assertLess(report["distance"]["mean_percent"], report["initial_distance"]["mean_percent"])
        self.assertEqual(report["stages"][0]["level"], 1)
        self.assertEqual(subvol.check(fit.mesh, BALL[0])["distance"], report["distance"])
        self.assertTrue(np.shares_memory(fit.mesh.points, fit.mesh.points))
        points = fit.cage.points
        kept = points.copy()
        del fit
        np.testing.assert_array_equal(points, kept)

    def test_a_fit_is_the_programs_bit_by_bit(self):
        self.run_program("fit", BALL[0], "--template", BALL[1], "--levels", "1",
                         "-o", "a.mesh", "-o", "cage:a_cage.mesh", "-o", "a.obj")
        fit = subvol.fit(*BALL, levels=1)
        subvol.write("b.mesh", fit)
        subvol.write("cage:b_cage.mesh", fit)
        subvol.write("b.obj", fit.mesh)
        self.assert_same_file("a.mesh", "b.mesh")
        self.assert_same_file("a_cage.mesh", "b_cage.mesh")
        self.assert_same_file("a.obj", "b.obj")
        np.testing.assert_array_equal(subvol.read("a.mesh").points, fit.mesh.points)
        from_arrays = subvol.fit(subvol.read(BALL[0]), subvol.read(BALL[1]), levels=1)
        np.testing.assert_array_equal(from_arrays.mesh.points, fit.mesh.points)

    def test_a_mesh_that_is_freed_from_its_cage_is_the_programs_bit_by_bit(self):
        self.run_program("template", "grid", "torus_target.off", "--size", "0.4", "-o", "grid.mesh")
        self.run_program("template", "carve", "grid.mesh", "--inside", "torus_target.off", "-o", "carved.mesh")
        self.run_program("fit", "torus_target.off", "--template", "carved.mesh", "--levels", "1", "-o", "freed.mesh")
        freed = subvol.fit("torus_target.off", "carved.mesh", levels=1, keep_cage=False)
        self.assertIsNone(freed.cage)
        self.assertNotIn("cage", freed.report)
        subvol.write("again.mesh", freed)
        self.assert_same_file("freed.mesh", "again.mesh")
        subvol.write("freed.glb", freed)
        with self.assertRaisesRegex(ValueError, "cage"):
            subvol.write("cage:freed_cage.mesh", freed)
        with self.assertRaisesRegex(ValueError, "keep_cage=False"):
            subvol.fit(*BALL, levels=1, keep_cage=False, cage_only=True)
        kept = subvol.fit("torus_target.off", "carved.mesh", levels=1)
        self.assertGreater(freed.report["quality"]["min_scaled_jacobian"],
                           2 * kept.report["quality"]["min_scaled_jacobian"])

    def test_a_fit_of_curved_cells_is_the_programs_bit_by_bit(self):
        self.run_program("fit", BALL[0], "--template", BALL[1], "--order", "2", "-o", "a.vtu")
        fit = subvol.fit(*BALL, order=2)
        self.assertIsNone(fit.cage)
        self.assertEqual(fit.mesh.order, 2)
        subvol.write("b.vtu", fit)
        self.assert_same_file("a.vtu", "b.vtu")
        again = subvol.read("b.vtu")
        np.testing.assert_array_equal(again.coefficients, fit.mesh.coefficients)
        self.assertEqual(subvol.check("b.vtu", BALL[0])["distance"], fit.report["distance"])

    def test_a_template_with_a_few_inverted_cells_is_untangled_as_with_the_program(self):
        template = subvol.read("torus_template.mesh")
        boundary = {tuple(point) for point in template.boundary().points}
        cell = template.hexes[0]
        corner = next(k for k in range(8) if tuple(template.points[cell[k]]) not in boundary)
        opposite = (corner + 2) % 4 + (0 if corner >= 4 else 4)
        template.points[cell[corner]] += 0.75 * (template.points[cell[opposite]] - template.points[cell[corner]])
        self.assertGreater(subvol.check(template)["quality"]["inverted_cells"], 0)
        subvol.write("tangled.mesh", template)
        for option, value, name in (("levels", 1, "mesh"), ("order", 2, "vtu")):
            self.run_program("fit", "torus_target.off", "--template", "tangled.mesh", f"--{option}", str(value),
                             "--max-iterations", "1", "-o", f"a.{name}", status=4)
            fit = subvol.fit("torus_target.off", "tangled.mesh", max_iterations=1, **{option: value})
            self.assertTrue(any("untangled" in warning for warning in fit.report["warnings"]))
            subvol.write(f"b.{name}", fit)
            self.assert_same_file(f"a.{name}", f"b.{name}")

    def test_a_template_is_made_where_none_is_given(self):
        fit = subvol.fit(BALL[0], cells=8, levels=1)
        self.assertEqual(fit.report["template"]["handles"], 0)
        self.assertEqual(fit.template.hexes.shape[1], 8)

    def test_the_same_bits_for_one_thread_and_two(self):
        one, two = (subvol.fit(*BALL, levels=1, max_iterations=5, threads=n) for n in (1, 2))
        np.testing.assert_array_equal(one.mesh.points, two.mesh.points)
        np.testing.assert_array_equal(one.cage.points, two.cage.points)

    def test_options_in_force_are_those_of_the_signature(self):
        for function, arguments in ((subvol.fit, BALL), (subvol.optimize, (cube(),)),
                                    (subvol.shell, (cube().boundary(), 0.1))):
            kinds = inspect.signature(function).parameters
            given = {"levels": 1, "max_iterations": 1} if function is subvol.fit else {}
            in_force = function(*arguments, **given).report["options"]
            for name, value in in_force.items():
                if kinds[name].default is not None and name not in given:
                    self.assertEqual(value, kinds[name].default, name)

    def test_none_is_the_default(self):
        given = dict(levels=1, max_iterations=1, tolerance=None, order=None, solver=None)
        options = subvol.fit(*BALL, **given).report["options"]
        self.assertEqual((options["solver"], options["tolerance"]), ("newton", None))

    def test_booleans_may_be_numpys(self):
        for value in (np.True_, np.False_):
            report = subvol.fit(*BALL, levels=1, max_iterations=1, cage_only=value).report
            self.assertIs(report["options"]["cage_only"], bool(value))

    def test_a_tolerance_that_is_missed_is_told(self):
        report = subvol.fit(*BALL, levels=1, tolerance=1e-6).report
        self.assertEqual((report["stop_reason"], report["converged"]), ("tolerance_missed", False))

    def test_options_that_make_no_sense_are_refused(self):
        def refused(error, text, **options):
            with self.assertRaises(error) as caught:
                subvol.fit(*BALL, **options)
            self.assertIn(text, str(caught.exception))

        refused(TypeError, "fit: there is no option 'level'; there are", level=2)
        refused(TypeError, "fit: levels must be a whole number, not 'two'", levels="two")
        refused(TypeError, "fit: levels must be a whole number, not True", levels=True)
        refused(TypeError, "fit: levels must be a whole number, not 2.0", levels=2.0)
        refused(TypeError, "fit: tolerance must be a number, not '1'", tolerance="1")
        refused(TypeError, "fit: cage_only must be True or False, not 'no'", cage_only="no")
        refused(TypeError, "progress must be callable", progress=3)
        refused(subvol.InputError, "fit: surface must be 'limit' or 'mesh', not 'limt'", surface="limt")
        refused(subvol.InputError, "levels must be in [1, 6]", levels=0)
        refused(subvol.InputError, "levels is far too large", levels=10**30)
        refused(subvol.InputError, "must be in", tolerance=float("nan"))
        refused(subvol.InputError, "lambda_far must be in", lambda_far=-1)
        refused(subvol.InputError, "fit: basis goes with order only", basis="legendre")
        refused(subvol.InputError, "fit: levels does not go with order", order=2, levels=2)
        refused(subvol.InputError, "fit: cells does not go with a template", cells=30)
        refused(subvol.InputError, "threads must be in [1, 1024]", threads=0)
        refused(subvol.InputError, "order must be in [1, 16]", order=17)
        with self.assertRaisesRegex(TypeError, "target must be a SurfaceMesh, a VolumeMesh or .* a file, not int"):
            subvol.fit(3)
        for base in (subvol.Error, ValueError):
            with self.assertRaises(base):
                subvol.fit(*BALL, levels=0)
        inside_out = subvol.VolumeMesh(CUBE_POINTS, hexes=CUBE[:, [4, 5, 6, 7, 0, 1, 2, 3]])
        with self.assertRaises(subvol.InputError):
            subvol.fit(BALL[0], inside_out)


class Tuning(InFolder):
    """Tuned numbers, for experiments."""

    def test_numbers_are_set_by_name(self):
        tune = {"fitting.coarse_lambda": 0.02}
        fit = subvol.fit(*BALL, levels=1, tune=tune)
        self.assertEqual(fit.report["stages"][0]["lambda"], 0.02)
        self.assertEqual(fit.report["options"]["tune"], tune)

    def test_unknown_names_and_values_out_of_range_are_refused(self):
        for tune, reason in (({"fitting.coarse": 0.02}, "there is no tuned number 'fitting.coarse'"),
                             ({"fitting.coarse_lambda": 2}, "must be from 1e-09 to 0.99")):
            with self.assertRaisesRegex(subvol.InputError, reason):
                subvol.fit(*BALL, levels=1, tune=tune)
        for tune in (3, {3: 0.5}, {"fitting.coarse_lambda": "low"}):
            with self.assertRaises(TypeError):
                subvol.fit(*BALL, levels=1, tune=tune)


class Points(InFolder):
    """Clouds as targets."""

    def test_an_array_is_fitted_as_the_file_of_it(self):
        points = np.loadtxt("torus_points.xyz")
        options = dict(levels=1, point_weights="area", max_iterations=3)
        fit = subvol.fit(points, "torus_template.mesh", **options)
        of_file = subvol.fit("torus_points.xyz", "torus_template.mesh", **options)
        np.testing.assert_array_equal(fit.cage.points, of_file.cage.points)
        self.assertTrue(fit.report["distance"]["one_sided"])
        self.assertEqual(subvol.check(fit.mesh, points)["distance"], fit.report["distance"])
        subvol.write("python.mesh", fit)
        self.run_program("fit", "torus_points.xyz", "--template", "torus_template.mesh", "--levels", "1",
                         "--point-weights", "area", "--max-iterations", "3", "-o", "program.mesh",
                         status=fit_status(fit))
        self.assert_same_file("python.mesh", "program.mesh")

    def test_curved_cells_follow_points(self):
        curved = subvol.fit(np.loadtxt("torus_points.xyz"), "torus_template.mesh", order=2, max_iterations=3)
        self.assertTrue(curved.report["distance"]["one_sided"])

    def test_what_makes_no_sense_is_refused(self):
        points = np.loadtxt("torus_points.xyz")
        for wrong, options in ((points, dict(template=None)), (points[:5], {}), (points[:, :2], {}),
                               (points, dict(crease_angle=40.0)), ("torus_target.off", dict(point_weights="area"))):
            with self.subTest(options), self.assertRaises(subvol.InputError):
                subvol.fit(wrong, **{"template": "torus_template.mesh", **options})


def fit_status(fit):
    """The program's exit status for a result."""
    if not fit.report["valid"]:
        return 1
    return 0 if fit.report["converged"] else 4


class States(InFolder):
    """Checkpoints, and states on the way."""

    def test_a_call_goes_on_where_an_earlier_one_ended(self):
        whole = subvol.fit(*BALL, levels=2)
        part = subvol.fit(*BALL, levels=2, checkpoint="ball.checkpoint", progress=lambda p: p.level < 2)
        self.assertEqual(part.report["stop_reason"], "cancelled")
        resumed = subvol.fit(*BALL, levels=2, resume="ball.checkpoint", threads=1)
        self.assertEqual(resumed.report["resumed_from"], "ball.checkpoint")
        self.assertGreater(resumed.report["recalled_stages"], 0)
        np.testing.assert_array_equal(resumed.cage.points, whole.cage.points)
        with self.assertRaisesRegex(subvol.InputError, "levels"):
            subvol.fit(*BALL, levels=1, resume="ball.checkpoint")
        with self.assertRaisesRegex(subvol.InputError, "no such file"):
            subvol.fit(*BALL, levels=1, resume="none.checkpoint")

    def test_names_of_checkpoints_need_not_be_utf_8(self):
        part = subvol.fit(*BALL, levels=1, checkpoint=b"ball\xe9", progress=lambda p: p.iteration < 2)
        self.assertEqual(part.report["stop_reason"], "cancelled")
        resumed = subvol.fit(*BALL, levels=1, resume=b"ball\xe9", checkpoint=b"nowhere\xe9/ball")
        self.assertEqual(resumed.report["resumed_from"], "ball\ufffd")
        self.assertRegex(resumed.report["warnings"][-1], "not up to date: nowhere\ufffd/ball")
        with self.assertRaisesRegex(subvol.InputError, "ball\ufffd: .*levels"):
            subvol.fit(*BALL, levels=2, resume=b"ball\xe9")

    def test_a_checkpoint_is_there_after_an_error_of_the_callback(self):
        def fails(progress):
            if progress.level == 2:
                raise KeyError("mine")

        with self.assertRaises(KeyError):
            subvol.fit(*BALL, levels=2, checkpoint="ball.checkpoint", progress=fails)
        self.assertGreater(subvol.fit(*BALL, levels=2, resume="ball.checkpoint").report["recalled_stages"], 0)

    def test_curved_cells_are_optimized(self):
        curved = subvol.fit(*BALL, order=2, max_iterations=3).mesh
        alone = subvol.optimize(curved)
        self.assertTrue(alone.report["valid"])
        self.assertEqual(alone.mesh.coefficients.shape, curved.coefficients.shape)
        drawn = subvol.optimize(curved, target=BALL[0], order=3, max_iterations=3)
        self.assertEqual(drawn.report["orders"]["max"], 3)
        subvol.write("curved.msh", curved)
        self.assertTrue(subvol.optimize("curved.msh", target=BALL[0], max_iterations=1).report["valid"])
        with self.assertRaisesRegex(subvol.InputError, "keeps its shape"):
            subvol.optimize(curved, tolerance=1.0)

    def test_an_optimization_goes_on(self):
        options = dict(target=BALL[0], order=2, max_iterations=5)
        whole = subvol.optimize(BALL[1], **options, checkpoint="curve.checkpoint")
        resumed = subvol.optimize(BALL[1], **options, resume="curve.checkpoint")
        self.assertGreater(resumed.report["recalled_stages"], 0)
        np.testing.assert_array_equal(resumed.mesh.coefficients, whole.mesh.coefficients)

    def test_states_lead_from_the_template_to_the_result(self):
        fit = subvol.fit(*BALL, levels=1, keep_states=True)
        self.assertEqual(fit.states[0][0], "template")
        np.testing.assert_allclose(fit.states[0][1], fit.template.points, atol=1e-12)
        self.assertEqual(len(fit.states), sum(stage["kept"] for stage in fit.report["stages"]))
        subvol.write("animation:ball.glb", fit)
        subvol.write("cutaway:inside.glb", fit, cut="z:0.3")
        without = subvol.fit(*BALL, levels=1)
        self.assertEqual(without.states, [])
        with self.assertRaisesRegex(subvol.Error, "no animation"):
            subvol.write("animation:none.glb", without)
        with self.assertRaisesRegex(subvol.InputError, "cut"):
            subvol.write("cutaway:none.glb", fit, cut="w")

    def test_the_energy_is_the_programs(self):
        fit = subvol.fit(*BALL, levels=1, energy="inverse_mean_ratio", keep_cage=False)
        subvol.write("python.mesh", fit)
        self.run_program("fit", BALL[0], "--template", BALL[1], "--levels", "1", "--energy", "inverse_mean_ratio",
                         "-o", "program.mesh")
        self.assert_same_file("python.mesh", "program.mesh")


class Running(InFolder):
    """Progress, cancelling and Ctrl-C; other threads meanwhile."""

    LONG = dict(levels=4)

    def setUp(self):
        super().setUp()
        self.target, self.template = subvol.read("torus_target.off"), subvol.read("torus_template.mesh")
        self.handler = signal.signal(signal.SIGINT, signal.default_int_handler)

    def tearDown(self):
        signal.signal(signal.SIGINT, self.handler)
        super().tearDown()

    def fit(self, **options):
        return subvol.fit(self.target, self.template, **{**self.LONG, **options})

    def test_progress_is_told(self):
        told = []
        subvol.fit(*BALL, levels=1, max_iterations=3, progress=told.append)
        self.assertGreater(len(told), 3)
        self.assertTrue(all(0 <= p.fraction <= 1 and p.energy > 0 and p.iteration > 0 for p in told))
        self.assertTrue(told[0].stage.startswith("level 1"))

    def test_false_ends_a_fit_with_the_best_result(self):
        steps = []
        fit = self.fit(progress=lambda p: steps.append(p) or len(steps) < 3)
        self.assertEqual(len(steps), 3)
        self.assertEqual(fit.report["stop_reason"], "cancelled")
        self.assertEqual(len(fit.cage.hexes), 60)

    def test_false_may_be_numpys_and_nothing_else_ends_a_fit(self):
        for said, ends in ((False, True), (np.False_, True), (np.True_, False), (None, False), (0, False),
                           (np.float64(0), False), (np.zeros(2, bool), False)):
            told = []
            subvol.fit(*BALL, levels=1, max_iterations=2, progress=lambda p: told.append(p) or said)
            self.assertEqual(len(told) == 1, ends, repr(said))

    def test_an_error_of_the_callback_comes_out(self):
        calls = []

        def fails(progress):
            calls.append(progress)
            raise KeyError("mine")

        for work in (lambda: self.fit(progress=fails),
                     lambda: subvol.fit(self.target, cells=60, progress=fails),
                     lambda: subvol.shell(self.target, "2%", progress=fails),
                     lambda: subvol.optimize(self.template, progress=fails),
                     lambda: subvol.template.auto(self.target, progress=fails)):
            calls.clear()
            with self.assertRaisesRegex(KeyError, "mine"):
                work()
            self.assertEqual(len(calls), 1)

    def interrupt(self, work):
        """work() would take much longer than the signal takes to come, and must not come to its end."""
        returned = []
        timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
        timer.start()
        try:
            with self.assertRaises(KeyboardInterrupt):
                work()
                returned.append(True)
                time.sleep(60)  # the signal is met here, too late
        finally:
            timer.cancel()
        self.assertFalse(returned)

    def test_ctrl_c_ends_a_fit_soon(self):
        self.interrupt(self.fit)

    def test_ctrl_c_ends_the_search_for_a_template_soon(self):
        self.interrupt(lambda: subvol.fit(self.target, levels=4))

    def test_ctrl_c_while_a_callback_runs(self):
        self.interrupt(lambda: self.fit(progress=lambda p: time.sleep(0.05)))

    def test_other_threads_run_meanwhile(self):
        ticks, done = [], threading.Event()

        def tick():
            while not done.wait(0.005):
                ticks.append(None)

        thread = threading.Thread(target=tick)
        thread.start()
        subvol.fit(*BALL, levels=1)
        done.set()
        thread.join()
        self.assertGreater(len(ticks), 1)  # one may come between the fit and the end

    def test_two_fits_at_a_time(self):
        results = [None, None]

        def run(i):
            results[i] = subvol.fit(*BALL, levels=1, max_iterations=3)

        threads = [threading.Thread(target=run, args=(i,)) for i in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        np.testing.assert_array_equal(results[0].mesh.points, results[1].mesh.points)


if __name__ == "__main__":
    unittest.main()
