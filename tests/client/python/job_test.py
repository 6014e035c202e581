"""Jobs through a real server, and what it refuses."""

import importlib.metadata
import pathlib
import re
import tempfile
import threading
import unittest

import numpy as np

import room
import vantage
from server import ServedTest
from vantage import errors
from vantage.v1 import (fleet_service_pb2, model_service_pb2, plan_pb2, scan_pb2,
                        session_service_pb2)

FIRST = np.array([1.8, 1.9, 1.5])
MERGED = scan_pb2.SCAN_STATE_MERGED


class JobTest(ServedTest):
    FLAGS = ("--threads", "2")

    def setUp(self):
        self.client = vantage.connect(self.server.address)
        self.addCleanup(self.client.close)

    def job(self, name):
        image = room.scan(FIRST)
        job = self.client.create_session(name, scanner=image.scanner(), density=100)
        self.assertEqual(job.upload(image).wait().state, MERGED)
        return job

    def test_whole_job(self):
        self.assertTrue(self.client.healthy())
        job = self.job("whole")
        plan = job.plan(work_limit_rays=3_000_000, seed=7).wait()
        self.assertEqual(plan.result.outcome, plan_pb2.PLAN_OUTCOME_VIEWS)
        places = vantage.positions(plan)
        self.assertEqual(places.shape, (len(plan.result.views), 3))
        heading = 25.0
        second = job.upload(room.scan(FIRST + places[0], heading, seed=2), display_name="second",
                            prior=vantage.pose(*places[0] + (0.05, -0.04, 0.02), heading + 2))
        merged = second.wait()
        self.assertEqual((merged.state, merged.display_name), (MERGED, "second"), merged.state_message)
        T = vantage.matrix(merged.pose)
        np.testing.assert_allclose(T[:3, 3], places[0], atol=0.01, err_msg="we know where it stood")
        np.testing.assert_allclose(T[0, 0], np.cos(np.radians(heading)), atol=1e-3)
        self.assertGreater(job.coverage().coverage.area_at_density_m2, 50)
        self.assertEqual(len(job.links().scans), 2)
        self.assertEqual([scan.name for scan in job.scans()],
                         ["sessions/whole/scans/scan-1", second.name])
        self.assertTrue(job.evaluate(*places[0]).feasible)
        job.reject(*places[0], radius=0.3, reason="wet floor", seconds=60)
        self.assertGreaterEqual(job.get().rejections[0].radius_m, 0.3)
        self.assertEqual(second.withdraw(), [])
        self.assertEqual(second.wait().state, scan_pb2.SCAN_STATE_WITHDRAWN)
        again = job.upload(room.scan(FIRST + places[0], heading, seed=2), display_name="second",
                           prior=vantage.pose(*places[0] + (0.05, -0.04, 0.02), heading + 2))
        self.assertNotEqual(again.name, second.name, "what was withdrawn may come again")

    def test_plan_is_repeatable_and_whole(self):
        job = self.job("plans")
        runs = [job.plan(work_limit_rays=2_000_000, seed=3) for _ in range(2)]
        ended = [run.wait() for run in runs]
        self.assertEqual(*([view.SerializeToString(deterministic=True) for view in plan.result.views]
                           for plan in ended))
        full = runs[0].full()
        cells = vantage.score_map(full)
        self.assertEqual(len(cells["centre"]), full.result.score_map.total_viewcell_count)
        self.assertEqual(cells["score"].shape, cells["score_lower"].shape)
        self.assertGreater(len(full.result.patches), 0)
        best = cells["centre"][np.argmax(cells["score"])]
        np.testing.assert_allclose(np.abs(best - vantage.positions(full)).max(axis=1).min(), 0, atol=0.6)
        self.assertEqual(len(list(job.plans())), 2)

    def test_plan_improves_and_is_cancelled_when_left(self):
        job = self.job("anytime")
        with job.plan(seconds=600, config=None) as run:
            revisions = []
            for plan in run:
                revisions.append(plan.revision)
                if plan.result.views:
                    break
        self.assertEqual(revisions, sorted(revisions))
        self.assertIn(run.wait().state, (plan_pb2.PLAN_STATE_CANCELLED, plan_pb2.PLAN_STATE_SUCCEEDED))
        with self.assertRaisesRegex(ValueError, "one budget"):
            job.plan(seconds=1, work_limit_rays=1)

    def test_a_doubtful_scan_is_a_persons_to_decide(self):
        job = self.job("doubt")
        scan = job.upload(room.scan(FIRST + (0.8, 0.5, 0), heading=180, seed=4),
                          prior=vantage.prior(vantage.pose(0.8, 0.5, 0, 0), trusted=True,
                                              covariance=np.diag([1e-6] * 3 + [1e-4] * 3)))
        decided = scan.wait()
        self.assertIn(decided.state, (scan_pb2.SCAN_STATE_DOUBTFUL, scan_pb2.SCAN_STATE_FAILED))
        self.assertTrue(decided.state_message)
        self.assertGreater(len(scan.compare(1000).poses), 0)
        with self.assertRaises(errors.InvalidArgument):
            scan.accept(rival_pose=99)
        scan.set_pose(vantage.pose(0.8, 0.5, 0, 180))
        self.assertEqual(scan.wait().state, MERGED)
        with self.assertRaises(errors.FailedPrecondition):
            scan.accept()

    def test_watch_tells_all_in_order(self):
        job = self.job("watched")
        seen = []
        for event in job.watch():
            seen.append((event.sequence, event.WhichOneof("event")))
            if event.WhichOneof("event") == "scan_merged":
                break
        self.assertEqual([number for number, _ in seen], list(range(1, len(seen) + 1)))
        self.assertEqual(seen[0][1], "session_created")
        later = job.watch(after=seen[-1][0])
        threading.Timer(0.2, lambda: job.reject(0, 0, 0)).start()
        self.assertEqual(next(later).WhichOneof("event"), "view_rejected")
        later.close()
        with self.assertRaises(errors.OutOfRange):
            next(job.watch(after=10_000))

    def test_files(self):
        job = self.client.create_session("files", density=100)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder, "room.xyz")
            points = room.scan(FIRST, step=3).points() + FIRST
            np.savetxt(path, points, "%.4f")
            with self.assertRaisesRegex(errors.FailedPrecondition, "seen from"):
                job.upload_file(path)
            scan, = job.upload_file(path, station=FIRST)
            self.assertEqual(scan.wait().state, MERGED)
            out = pathlib.Path(folder, "job.ply")
            size = job.export(model_service_pb2.EXPORT_FORMAT_SCANS_PLY, out)
            self.assertEqual(out.stat().st_size, size)
            self.assertTrue(out.read_bytes().startswith(b"ply\n"))
            self.assertEqual(sorted(p.name for p in path.parent.iterdir()), ["job.ply", "room.xyz"])
            report = pathlib.Path(folder, "job.html")
            self.assertEqual(job.report(report, language="de"), report.stat().st_size)
            self.assertIn('lang="de"', report.read_text(encoding="utf-8"))
            before = report.read_bytes()
            with self.assertRaises(errors.InvalidArgument) as caught:
                job.report(report, language="xx")
            self.assertEqual([v.field for v in caught.exception.violations], ["language"])
            self.assertEqual(report.read_bytes(), before)
            self.assertEqual(sorted(p.name for p in path.parent.iterdir()), ["job.html", "job.ply", "room.xyz"])

    def test_errors_say_all(self):
        with self.assertRaises(errors.InvalidArgument) as caught:
            self.client.create_session("bad", density=-1, voxel_size=9)
        fields = {violation.field for violation in caught.exception.violations}
        self.assertLessEqual({"session.planning_config.required_density_per_m2",
                              "session.model_config.voxel_size_m"}, fields, "all, not the first")
        self.assertIn("correct the fields", str(caught.exception))
        with self.assertRaises(errors.NotFound) as caught:
            self.client.session("nowhere").get()
        self.assertTrue(caught.exception.reason)
        self.client.create_session("taken")
        with self.assertRaises(errors.AlreadyExists) as caught:
            self.client.create_session("taken")
        self.assertEqual(caught.exception.reason, "SESSION_EXISTS")
        with self.assertRaises(errors.FailedPrecondition):
            self.client.session("taken").plan()
        self.assertIsInstance(caught.exception, vantage.VantageError)
        # A call that has no method of its own here.
        answer = self.client.call(fleet_service_pb2.ListScannersRequest(parent="sessions/taken"))
        self.assertEqual(len(answer.scanners), 0)
        with self.assertRaises(TypeError):
            self.client.call(session_service_pb2.WatchSessionRequest())

    def test_lists_go_page_after_page(self):
        for i in range(55):
            self.client.create_session(f"many-{i}")
        self.assertEqual(len(list(self.client.sessions("many-"))), 55)
        self.client.session("many-3").delete()
        self.assertEqual(len(list(self.client.sessions("many-"))), 54)


class UnreachableTest(unittest.TestCase):
    def test_says_where(self):
        with vantage.connect("unix:/nowhere/s", attempts=2, timeout=5) as client:
            self.assertFalse(client.healthy())
            with self.assertRaisesRegex(errors.Unavailable, "cannot reach the server at unix:/nowhere/s"):
                client.session("x").get()

    def test_a_token_never_travels_in_the_clear(self):
        with self.assertRaisesRegex(ValueError, "tls_ca"):
            vantage.connect("example.org:7443", token_file="/token")
        with self.assertRaisesRegex(ValueError, "need one another"):
            vantage.connect("example.org:7443", tls_ca="/ca", tls_cert="/cert")
        with self.assertRaises(TypeError):
            vantage.connect("127.0.0.1:1", no_such_option=1)


class PoseTest(unittest.TestCase):
    def test_there_and_back(self):
        from vantage.geometry import pose_of
        rng = np.random.default_rng(5)
        for _ in range(200):
            Q, R = np.linalg.qr(rng.normal(size=(3, 3)))
            Q = Q * np.sign(np.diag(R))
            T = np.eye(4)
            T[:3, :3] = Q if np.linalg.det(Q) > 0 else Q[:, [1, 0, 2]]
            T[:3, 3] = rng.normal(size=3)
            np.testing.assert_allclose(vantage.matrix(pose_of(T)), T, atol=1e-12)
        for half_turn in np.diag([1., -1, -1]), np.diag([-1., 1, -1]), np.diag([-1., -1, 1]):
            T = np.eye(4)
            T[:3, :3] = half_turn
            np.testing.assert_allclose(vantage.matrix(pose_of(T)), T, atol=1e-12)
        with self.assertRaisesRegex(ValueError, "not rigid"):
            pose_of(2 * np.eye(4) - np.diag([0, 0, 0, 1.]))
        with self.assertRaisesRegex(ValueError, "covariance"):
            vantage.prior(vantage.pose(0, 0, 0), covariance=np.eye(3))


class ReleaseTest(unittest.TestCase):
    def test_is_the_repositorys(self):
        page = pathlib.Path(__file__).resolve().parents[3] / "CMakeLists.txt"
        version, = re.findall(r"^project\(vantage VERSION (\S+)", page.read_text(), re.M)
        self.assertEqual(vantage.__version__, version)

    def test_runs_anywhere(self):
        wheel = importlib.metadata.distribution("vantage")
        self.assertEqual(wheel.version, vantage.__version__)
        told = wheel.read_text("WHEEL")
        self.assertIn("Root-Is-Purelib: true", told)
        self.assertIn("Tag: py3-none-any", told)
        names = [str(file) for file in wheel.files]
        self.assertEqual([name for name in names if name.endswith((".so", ".pyd", ".dll"))], [])
        self.assertIn("vantage/py.typed", names)
        self.assertEqual({name.split("/")[0] for name in names if ".dist-info" not in name}, {"vantage"},
                         "nothing under another's name")


if __name__ == "__main__":
    unittest.main()
