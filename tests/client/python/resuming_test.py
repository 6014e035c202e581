"""Uploads and watches that outlive their links."""

import hashlib
import signal
import threading
import time
import unittest

import numpy as np

import room
import vantage
from server import Server
from vantage import errors
from vantage.resumption import LoadingWait
from vantage.v1 import scan_pb2

FIRST = (1.8, 1.9, 1.5)


def unavailable(reason):
    failure = errors.Unavailable("not now")
    failure.reason, failure.retry_seconds = reason, 0.05
    return failure


class LoadingTest(unittest.TestCase):
    def test_a_model_that_is_loaded_is_waited_for(self):
        wait = LoadingWait(0.2)
        begun = time.monotonic()
        times = 0
        while wait.after(unavailable("MODEL_LOADING")):
            times += 1
        self.assertTrue(2 <= times <= 5, times)
        self.assertGreater(time.monotonic() - begun, 0.2)
        self.assertFalse(LoadingWait(9).after(unavailable("")), "nobody is there")

    def test_no_attempt_is_no_call(self):
        with self.assertRaisesRegex(ValueError, "attempts"):
            vantage.connect("127.0.0.1:1", attempts=0)

    def test_a_token_stays_here(self):
        with self.assertRaisesRegex(ValueError, "token_file"):
            vantage.connect("127.example.com:443", token_file="/dev/null")


class ResumingTest(unittest.TestCase):
    def setUp(self):
        self.server = Server()
        self.addCleanup(self.server.close)
        self.client = vantage.connect(self.server.address, give_up_after=60)
        self.addCleanup(self.client.close)
        # Some 20 pieces.
        self.image = room.scan(FIRST, step=0.25)
        self.job = self.client.create_session("job", scanner=self.image.scanner(), density=100)

    def is_whole(self, scan):
        self.assertEqual(scan.get().sha256, hashlib.sha256(self.image.to_bytes()).digest())
        self.assertEqual(len(list(self.job.scans())), 1)

    def broken(self, break_it):
        """Uploads, and breaks something once a third is stored; answers the scan and the progress."""
        done = threading.Event()

        def watch(progress):
            self.last = progress
            if progress.acknowledged_bytes * 3 > progress.total_bytes and not done.is_set():
                self.assertLess(progress.acknowledged_bytes, progress.total_bytes)
                done.set()
                break_it()
        scan = self.job.upload(self.image, progress=watch)
        self.assertTrue(done.is_set())
        return scan

    def test_server_is_killed_and_started_again(self):
        def kill():
            self.server.kill()
            threading.Timer(0.5, self.server.start).start()
        scan = self.broken(kill)
        self.assertGreater(self.last.reconnects, 0)
        # What had been acknowledged did not travel twice.
        self.assertLess(self.last.sent_bytes, 1.5 * self.last.total_bytes)
        self.is_whole(scan)

    def test_link_falls_silent(self):
        def stop():
            self.server.signal(signal.SIGSTOP)
            threading.Timer(10.5, self.server.signal, [signal.SIGCONT]).start()
        began = time.monotonic()
        scan = self.broken(stop)
        self.assertLess(time.monotonic() - began, 40)
        self.assertGreater(self.last.reconnects, 0)
        self.is_whole(scan)

    def test_program_is_started_again(self):
        def leave():
            raise KeyboardInterrupt
        with self.assertRaises(KeyboardInterrupt):
            self.broken(leave)
        kept = self.last.acknowledged_bytes
        with vantage.connect(self.server.address) as another:
            first = []
            scan = another.session("job").upload(
                self.image, progress=lambda p: first.append((p.acknowledged_bytes, p.sent_bytes)))
            self.assertLess(first[-1][1], self.last.total_bytes - 0.5 * kept, "goes on where it was")
            self.assertEqual(another.session("job").upload(self.image).name, scan.name)
        self.is_whole(self.job.scan(scan.name))

    def test_gives_up(self):
        client = vantage.connect(self.server.address, give_up_after=1, timeout=1)
        self.addCleanup(client.close)
        job = client.session("job")
        self.server.kill()
        with self.assertRaises(errors.Unavailable):
            job.upload(self.image)

    def test_a_lost_link_comes_back_while_one_waits(self):
        client = vantage.connect(self.server.address, attempts=1)
        self.addCleanup(client.close)
        job = client.session("job")
        job.get()
        self.server.kill()
        for _ in range(4):
            with self.assertRaises(errors.Unavailable):
                job.get()
            client._connection.wait(0.3)
        self.server.start()
        client._connection.wait(3)
        self.assertEqual(job.get().name, "sessions/job")

    def reject_once_served(self):
        # However long a busy machine takes to start the server.
        while True:
            try:
                return self.job.reject(0, 0, 0)
            except errors.Unavailable:
                time.sleep(0.2)

    def test_watch_and_plan_go_on(self):
        small = room.scan(FIRST)
        self.assertEqual(self.job.upload(small).wait().state, scan_pb2.SCAN_STATE_MERGED)
        events = self.job.watch()
        seen = [next(events).sequence for _ in range(5)]
        self.server.kill()
        threading.Timer(0.5, self.server.start).start()
        threading.Timer(3, self.reject_once_served).start()
        for event in events:
            seen.append(event.sequence)
            if event.WhichOneof("event") == "view_rejected":
                break
        events.close()
        self.assertEqual(seen, list(range(1, len(seen) + 1)), "none missed, none twice")
        plan = self.job.plan(work_limit_rays=1_000_000).wait()
        self.assertGreater(len(plan.result.views), 0)
        self.assertTrue(np.isfinite(vantage.positions(plan)).all())


if __name__ == "__main__":
    unittest.main()
