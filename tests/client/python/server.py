"""vantaged on a socket of its own, which can be killed and started again with what it kept."""

import os
import pathlib
import signal
import subprocess
import tempfile
import time
import unittest

BINARY = os.environ["VANTAGE_SERVER_BINARY"]


class Server:
    def __init__(self, *flags):
        self.folder = tempfile.TemporaryDirectory(prefix="vantage-python-")
        self.socket = pathlib.Path(self.folder.name, "s")
        self.address = f"unix:{self.socket}"
        self.flags = flags
        self.process = None
        self.start()

    def start(self):
        self.log = open(pathlib.Path(self.folder.name, "log"), "ab")
        self.process = subprocess.Popen(
            [BINARY, "--listen", self.address, "--data", f"{self.folder.name}/data", *self.flags],
            stdout=self.log, stderr=self.log, stdin=subprocess.DEVNULL)
        deadline = time.monotonic() + 60
        while not self.socket.exists():
            if self.process.poll() is not None or time.monotonic() > deadline:
                raise AssertionError(pathlib.Path(self.folder.name, "log").read_text()[-4000:])
            time.sleep(0.02)

    def kill(self):
        self.process.kill()
        self.process.wait()
        self.log.close()
        self.socket.unlink(missing_ok=True)

    def signal(self, number):
        self.process.send_signal(number)

    def close(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.kill()
        self.folder.cleanup()


class ServedTest(unittest.TestCase):
    """Tests of one server."""

    FLAGS = ()

    @classmethod
    def setUpClass(cls):
        cls.server = Server(*cls.FLAGS)
        cls.addClassCleanup(cls.server.close)
