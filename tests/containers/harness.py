"""What the tests share: the engine, the image, a server in a container."""

import atexit
import glob
import os
import pathlib
import signal
import subprocess
import sys
import time
import types
import unittest

import job as jobs
import room_scan
from engine import FOLDER, ROOT, Engine, Failed, ServerContainer

PACKAGES = os.path.abspath(os.environ.get("VANTAGE_PACKAGES", ROOT / "build" / "package"))
BASE_AGE = 7 * 24 * 3600  # s, after which the cached base is made anew
PARTS = {"server": "vantage-server", "client": "vantage-client", "coredev": "libvantage-core-dev",
         "clientdev": "libvantage-client-dev", "pythoncore": "python3-vantage-core"}
# Made when the first test needs it: the engine, a bare Debian, the server's image.
house = types.SimpleNamespace(engine=None, base=None, image=None, refused=None)


def say(text):
    print(f"  {text}", file=sys.stderr, flush=True)


def package(name):
    found = glob.glob(f"{PACKAGES}/{PARTS[name]}_*.deb")
    assert len(found) == 1, f"one {PARTS[name]} package in {PACKAGES}, not {found}"
    return pathlib.Path(found[0])


def base_tar():
    cache = pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache")
    tar = cache / "vantage" / "bookworm.tar"
    if not tar.exists() or time.time() - tar.stat().st_mtime > BASE_AGE:
        begun = time.monotonic()
        done = subprocess.run([FOLDER / "make_base.sh", tar], text=True, stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
        if done.returncode:
            raise Failed(f"make_base.sh: {done.stdout[-2000:]}")
        say(f"base image made of Debian's packages in {time.monotonic() - begun:.0f} s")
    return tar


def open_house():
    """Once, whichever module comes first; skips all tests where no containers run."""
    if house.refused:
        raise unittest.SkipTest(house.refused)
    if house.image:
        return
    try:
        given = os.environ.get("VANTAGE_IMAGE")
        house.engine = Engine(os.environ.get("VANTAGE_ENGINE", "podman"), own_storage=not given)
        atexit.register(house.engine.close)
        signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
        house.base = os.environ.get("VANTAGE_BASE") or house.engine.import_base(base_tar())
        house.engine.run("run", "--rm", "--network", "host", "--memory", "64m", house.base, "true")
    except (Failed, subprocess.TimeoutExpired) as why:
        say(f"skipped: no containers run here: {why}")
        house.refused = "no containers run here"
        raise unittest.SkipTest(house.refused) from None
    if given:
        house.image = given
        return
    begun = time.monotonic()
    house.image = house.engine.build("server", ROOT / "docker" / "Dockerfile", ROOT,
                                     BASE=house.base, PACKAGE=package("server").name)
    say(f"{house.engine.name}: image built in {time.monotonic() - begun:.0f} s")


class ContainerTest(unittest.TestCase):
    def setUp(self):
        self.opened = []

    def tearDown(self):
        for job in self.opened:
            job.close()

    def serve(self, volume, *flags, options=()):
        server = ServerContainer(house.engine, house.image, volume, *flags, options=options)

        def end():
            outcome = self._outcome
            if not outcome.success:
                print(server.logs()[-4000:], file=sys.stderr)
            server.remove()
        self.addCleanup(end)
        return server

    def until_serving(self, server, patience=60, credentials=None):
        """Seconds from the start to SERVING."""
        address = server.address(patience)
        while not jobs.healthy(address, credentials):
            self.assertTrue(server.running(), server.logs())
            self.assertLess(time.monotonic() - server.started, patience, "still not SERVING")
            time.sleep(0.02)
        return time.monotonic() - server.started

    def job(self, server, session="job"):
        job = jobs.Job(server.address(), session)
        self.opened.append(job)
        return job

    def started_job(self, server, **how):
        job = self.job(server)
        job.create(**how)
        first = job.push(FIRST_SCAN)
        self.assertEqual(state_of(first), "SCAN_STATE_MERGED", first)
        return job


FIRST_SCAN = room_scan.encoded(room_scan.FIRST)


def name_of(message, field):
    kind = message.DESCRIPTOR.fields_by_name[field].enum_type
    return kind.values_by_number[getattr(message, field)].name


def state_of(message):
    return name_of(message, "state")
