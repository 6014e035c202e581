"""The examples, run as somebody would."""

import contextlib
import io
import pathlib
import tempfile
import unittest

import plan_job
from server import ServedTest


class ExampleTest(ServedTest):
    def test_a_job_is_plotted(self):
        with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()) as said:
            out = pathlib.Path(folder, "job.png")
            plan_job.main(["--server", self.server.address, "--scans", "3", "--out", str(out)])
            picture = out.read_bytes()
        self.assertEqual(picture[:8], b"\x89PNG\r\n\x1a\n")
        self.assertGreater(len(picture), 50_000)
        self.assertEqual(said.getvalue().count("SCAN_STATE_MERGED"), 3, said.getvalue())


if __name__ == "__main__":
    unittest.main()
