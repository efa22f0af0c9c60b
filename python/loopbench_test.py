"""Tests of the Python module; $LOOPBENCH is the program."""
import ctypes
import doctest
import os
import pathlib
import tempfile
import unittest

import numpy as np

import loopbench

ROOT = pathlib.Path(__file__).resolve().parent.parent
FOUR_BAR = ROOT / "configs/mechanisms/four-bar.json"


class RightHandSide(unittest.TestCase):
    @classmethod
    def setUpClass(self):
        self.f = loopbench.Mechanism(FOUR_BAR).compile("odca")

    def test_formulations_agree(self):
        other = loopbench.Mechanism(FOUR_BAR).compile("lagrange")
        self.assertEqual(self.f.state_names[:2], ["OA.angle", "AB.angle"])
        self.assertEqual(self.f.state_units[0], "rad")
        np.testing.assert_array_equal(self.f.start, other.start)
        # both solve the same equations; their condition is below 1e3
        np.testing.assert_allclose(self.f(0.0, self.f.start), other(0.0, other.start), atol=1e-12)

    def test_jacobian_against_differences(self):
        y, h = self.f.start + 0.0, 1e-5
        y[3:] = [0.5, -0.3, 0.2]
        columns = [(self.f(0.0, y + h * e) - self.f(0.0, y - h * e)) / (2 * h) for e in np.eye(6)]
        # central differences: h^2 times third derivatives, plus round-off over h
        np.testing.assert_allclose(self.f.jacobian(0.0, y), np.transpose(columns), atol=1e-7)

    def test_energy_is_kept(self):
        y, before = self.f.start, sum(self.f.energy(0.0, self.f.start))
        h = 1e-3
        for _ in range(1000):  # classical Runge-Kutta method, error of order h^4
            k1 = self.f(0.0, y)
            k2 = self.f(0.0, y + h / 2 * k1)
            k3 = self.f(0.0, y + h / 2 * k2)
            k4 = self.f(0.0, y + h * k3)
            y = self.f.project(0.0, y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
        self.assertLess(abs(sum(self.f.energy(0.0, y)) - before), 1e-9 * abs(before))

    def test_wrong_sizes(self):
        with self.assertRaises(ctypes.ArgumentError):
            self.f(0.0, [1.0, 2.0])


class Motion(unittest.TestCase):
    def test_columns_and_record(self):
        motion = loopbench.Mechanism(FOUR_BAR).simulate(2.0, "reduction", rtol=1e-9, step=0.5)
        np.testing.assert_array_equal(motion.index, [0.0, 0.5, 1.0, 1.5, 2.0])
        self.assertAlmostEqual(motion["joint:OA:angle [rad]"].iloc[0], -1.0, delta=1e-15)
        energy = motion["energy:kinetic [J]"] + motion["energy:potential [J]"]
        self.assertLess(energy.max() - energy.min(), 1e-6)
        self.assertEqual(motion.attrs["record"]["formulation"], "reduction")

    def test_tables_and_fixed_steps(self):
        with tempfile.TemporaryDirectory() as folder:
            table = pathlib.Path(folder, "midpoint.json")
            table.write_text('{"name": "midpoint", "A": [[0, 0], [0.5, 0]], "b": [0, 1], "c": [0, 0.5], "order": 2}')
            motion = loopbench.Mechanism(FOUR_BAR).simulate(1.0, integrator=str(table), fixed_steps=0.01)
        self.assertEqual(motion.attrs["record"]["integrator"], "midpoint")
        self.assertEqual(motion.attrs["record"]["steps"], 100)

    def test_reference_and_limits(self):
        mechanism = loopbench.Mechanism(FOUR_BAR)
        record = mechanism.simulate(np.int64(1), step=np.float32(0.5), reference={}).attrs["record"]
        self.assertEqual(record["kind"], "accuracy")
        self.assertLess(record["error_position_max"], 1e-6)
        with self.assertRaisesRegex(loopbench.Error, "step-limit"):
            mechanism.simulate(1.0, reference={}, limits={"steps": 3})
        with self.assertRaisesRegex(loopbench.Error, "found 2 cases"):
            mechanism.simulate(1.0, tolerances=[1e-5, 1e-6])

    def test_store(self):
        with tempfile.TemporaryDirectory() as folder:
            experiment = pathlib.Path(folder, "e.json")
            experiment.write_text('{"name": "e", "problems": [{"mechanism": "%s", "horizon": 1}], "methods": '
                                  '[{"formulation": ["odca", "lagrange"], "enforcement": "velocity"}], "tolerances": [1e-6]}' % FOUR_BAR)
            loopbench._run("run", experiment, "--out", pathlib.Path(folder, "out"), "--no-timing")
            runs = loopbench.read_store(pathlib.Path(folder, "out"))
        self.assertEqual(sorted(runs["formulation"]), ["lagrange", "odca"])
        self.assertTrue((runs["drift_position_max"] > 0).all())

    def test_messages(self):
        with self.assertRaisesRegex(loopbench.Error, "no-such.json"):
            loopbench.Mechanism("no-such.json")
        with self.assertRaisesRegex(loopbench.Error, "no-such-cc: cannot be run"):
            loopbench.Mechanism(FOUR_BAR).compile(cc="no-such-cc")
        with self.assertRaisesRegex(loopbench.Error, "formulation.*odca"):
            loopbench.Mechanism(FOUR_BAR).simulate(1.0, "newton")

    def test_page(self):
        os.chdir(ROOT)
        text = (ROOT / "docs/python.md").read_text().replace("```", "")
        page = doctest.DocTestParser().get_doctest(text, {}, "docs/python.md", None, 0)
        failures, _ = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(page)
        self.assertEqual(failures, 0)


if __name__ == "__main__":
    unittest.main()
