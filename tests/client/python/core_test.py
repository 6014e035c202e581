"""vantage_core: the planner without a server, on arrays."""

import pathlib
import tempfile
import threading
import time
import unittest

import numpy as np

import room
import vantage_core as core

FIRST = np.array([1.8, 1.9, 1.5])


def at(x, y, z, heading=0.0):
    c, s = np.cos(np.radians(heading)), np.sin(np.radians(heading))
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, z], [0, 0, 0, 1.]])


class CoreTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.image = room.scan(FIRST)
        cls.scanner = core.Scanner.of(cls.image)
        cls.config = core.PlanningConfig()
        cls.config.required_density = 100

    def model(self):
        model = core.Model()
        model.insert("first", self.image, self.scanner, np.eye(4))
        return model

    def test_carves(self):
        model = core.Model(voxel_size=0.1)
        report = model.insert("first", self.image, self.scanner, np.eye(4))
        self.assertEqual((report.version, model.version), (1, 1))
        self.assertGreater(report.samples, 20_000)
        voxels = model.voxels()
        self.assertEqual(voxels.centre.shape, (len(voxels.state), 3))
        # What lies inside of the room and was seen through is empty, its walls are surface.
        inside = voxels.centre + FIRST
        empty = voxels.state == int(core.VoxelState.EMPTY)
        self.assertTrue((inside[empty] > -0.05).all() and (inside[empty] < np.add(room.ROOM, 0.05)).all())
        true = voxels.state == int(core.VoxelState.TRUE_SURFACE)
        self.assertGreater((voxels.density[true] > 0).mean(), 0.9)
        self.assertFalse(voxels.density[empty].any())
        floor = inside[true][np.abs(inside[true][:, 2]) < 0.1]
        self.assertGreater(len(floor), 500)
        self.assertTrue(model.surface_ply().startswith(b"ply"))

    def test_withdrawing_leaves_what_was(self):
        model = self.model()
        before = model.voxels()
        model.insert("second", room.scan(FIRST + (0.8, 0.5, 0), seed=2), self.scanner, at(0.8, 0.5, 0))
        self.assertNotEqual(len(model.voxels().state), len(before.state))
        model.withdraw("second")
        np.testing.assert_array_equal(model.voxels().state, before.state)
        with self.assertRaises(KeyError):
            model.withdraw("second")

    def test_registers(self):
        model = self.model()
        second = room.scan(FIRST + (0.8, 0.5, 0), heading=25, seed=2)
        for prior in (at(0.85, 0.45, 0.02, 27), None):
            found = model.register(second, self.scanner, prior)
            self.assertEqual(found.outcome, core.Outcome.REGISTERED, found.reason)
            np.testing.assert_allclose(found.T_world_scan, at(0.8, 0.5, 0, 25), atol=0.01)
            self.assertLess(found.error_bound, 0.01)
            self.assertEqual(found.covariance.shape, (6, 6))
        wrong = model.register(second, self.scanner, at(0.8, 0.5, 0, 205), 1e-6 * np.eye(6))
        self.assertNotEqual(wrong.outcome, core.Outcome.REGISTERED)
        self.assertTrue(wrong.reason and wrong.remedy)

    def test_plans(self):
        model = self.model()
        plans = [model.plan(self.scanner, self.config, work_limit_rays=2_000_000) for _ in range(2)]
        for plan in plans:
            self.assertGreater(len(plan.views), 0)
            self.assertTrue(plan.views[0].registers)
            self.assertIn("from the last station", plan.views[0].description)
            self.assertEqual(plan.score_map.shape[1], 4)
        np.testing.assert_array_equal([v.position for v in plans[0].views],
                                      [v.position for v in plans[1].views])
        self.assertFalse(plans[0].stop)

    def test_plan_is_told_of_and_ended_by_the_caller(self):
        told = []
        plan = self.model().plan(self.scanner, self.config, seconds=120,
                                 progress=lambda now: told.append(len(now.views)) or len(told) < 2)
        self.assertEqual(len(told), 2)
        self.assertFalse(plan.complete)

        def fails(_):
            raise LookupError("mine")
        with self.assertRaisesRegex(LookupError, "mine"):
            self.model().plan(self.scanner, self.config, seconds=120, progress=fails)

    def test_other_threads_run(self):
        model = self.model()
        ticks, ended = [], threading.Event()

        def tick():
            while not ended.is_set():
                ticks.append(time.monotonic())
                time.sleep(0.005)
        thread = threading.Thread(target=tick)
        thread.start()
        began = time.monotonic()
        model.plan(self.scanner, self.config, work_limit_rays=2_000_000)
        took = time.monotonic() - began
        ended.set()
        thread.join()
        self.assertGreater(len([t for t in ticks if began < t < began + took]), 5)
        self.assertLess(max(np.diff(ticks)), 0.5 * took + 0.2)

    def test_files(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder, "room.vrim")
            path.write_bytes(self.image.to_bytes())
            image, scanner, pose = core.read(str(path))
            np.testing.assert_allclose(image.ranges, self.image.ranges, atol=1e-4)
            self.assertAlmostEqual(scanner.azimuth_step, self.scanner.azimuth_step)
            self.assertIsNone(pose)
            T = core.level(image, scanner)
            np.testing.assert_allclose(T[:3, :3], np.eye(3), atol=2e-3)
            with self.assertRaisesRegex(ValueError, "setup: 1"):
                core.read(str(path), 1)
            with self.assertRaises(KeyError):
                core.read(f"{folder}/none.ptx")

    def test_bad_input_is_named(self):
        model = self.model()
        for call, says in (
                (lambda: model.insert("first", self.image, self.scanner, np.eye(4)), "first"),
                (lambda: model.insert("x", self.image, self.scanner, 2 * np.eye(4)), "T_world_scan.*rigid"),
                (lambda: core.Model(voxel_size=9), "voxel"),
                (lambda: core.Model().register(self.image, self.scanner, np.eye(4)), "(?i)model|surface"),
                (lambda: model.plan(self.scanner, self.config), "one budget"),
                (lambda: model.register(self.image, self.scanner, None, np.eye(6)), "covariance")):
            with self.assertRaisesRegex(ValueError, says):
                call()
        bad = core.PlanningConfig()
        bad.required_density = -1
        with self.assertRaisesRegex(ValueError, "density"):
            model.plan(self.scanner, bad, seconds=1)
        image = room.scan(FIRST)
        image.ranges = image.ranges.T
        with self.assertRaisesRegex(ValueError, "ranges.*shape"):
            model.insert("x", image, self.scanner, np.eye(4))
        self.assertEqual(model.version, 1, "as it was")


if __name__ == "__main__":
    unittest.main()
