"""podman or docker, by their command lines. Everything that it makes is gone when it is closed."""

import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import time
import uuid

FOLDER = pathlib.Path(__file__).resolve().parent
ROOT = FOLDER.parent.parent


class Failed(Exception):
    """A command that did not succeed; says which, and what it said."""


class Engine:
    def __init__(self, name, own_storage=True):
        if not shutil.which(name):
            raise Failed(f"{name} is not installed")
        self.name = name
        self.prefix = f"vantage-test-{uuid.uuid4().hex[:8]}"
        self.command = [name]
        self.environment = dict(os.environ)
        self.images, self.volumes, self.containers, self.folders = [], [], [], []
        self.storage = None
        self.work = self.scratch()  # conmon leaves a file where it is started when memory ran out
        if name == "podman":
            self.environment["CONTAINERS_CONF"] = str(FOLDER / "containers.conf")
        if name == "podman" and own_storage:
            # A storage of its own, on a disk: nobody else's images are seen or touched.
            (ROOT / "build").mkdir(exist_ok=True)
            self.storage = tempfile.mkdtemp(prefix="containers-", dir=ROOT / "build")
            # Its run folder's name may have 50 characters, wherever the checkout is.
            self.command += ["--root", f"{self.storage}/root", "--runroot", self.scratch(),
                             "--storage-driver", "overlay", "--log-level", "fatal"]
        if name == "docker":
            self.environment["DOCKER_BUILDKIT"] = "1"

    def run(self, *arguments, timeout=120, allowed=(0,)):
        """Runs a command of the engine; answers its output."""
        done = subprocess.run([*self.command, *map(str, arguments)], env=self.environment,
                              text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, timeout=timeout, check=False,
                              cwd=self.work)
        if done.returncode not in allowed:
            raise Failed(f"{self.name} {' '.join(map(str, arguments))}: {done.returncode}\n"
                         f"{done.stdout[-4000:]}{done.stderr[-4000:]}")
        return done.stdout.strip()

    def import_base(self, tar):
        tag = self.new_image("base")
        self.run("import", tar, tag, timeout=300)
        return tag

    def new_image(self, name):
        tag = f"localhost/{self.prefix}-{name}"
        self.images.append(tag)
        return tag

    def build(self, name, dockerfile, context, timeout=900, options=(), **arguments):
        tag = self.new_image(name)
        given = [f"--build-arg={key}={value}" for key, value in arguments.items()]
        form = ["--format", "docker"] if self.name == "podman" else []
        self.run("build", *form, "--network", "host", "-f", dockerfile, "-t", tag, *options, *given, context,
                 timeout=timeout)
        return tag

    def scratch(self):
        """A folder that goes with the engine."""
        self.folders.append(tempfile.mkdtemp(prefix="vantage-containers-"))
        return self.folders[-1]

    def new_volume(self):
        volume = f"{self.prefix}-{len(self.volumes)}"
        self.run("volume", "create", volume)
        self.volumes.append(volume)
        return volume

    def remove(self, *arguments):
        """Whether it was there or not, and whatever the engine says."""
        try:
            self.run(*arguments)
        except (Failed, OSError, subprocess.TimeoutExpired):
            pass

    def close(self):
        for container in self.containers:
            self.remove("rm", "-f", "-v", container)
        for volume in self.volumes:
            self.remove("volume", "rm", "-f", volume)
        for image in reversed(self.images):
            self.remove("rmi", "-f", image)
        if self.storage:
            self.remove("rmi", "-f", "-a")
            # What podman mounts for itself.
            subprocess.run(["umount", f"{self.storage}/root/overlay"], stderr=subprocess.DEVNULL,
                           check=False)
            shutil.rmtree(self.storage, ignore_errors=True)
        for folder in self.folders:
            shutil.rmtree(folder, ignore_errors=True)


class Container:
    """A container of an image that runs in the background."""

    def __init__(self, engine, image, *command, network="host", options=()):
        self.engine = engine
        self.name = f"{engine.prefix}-{len(engine.containers)}"
        engine.containers.append(self.name)
        # Asked from here, not by a timer of the engine's.
        self.starts, self.started = 1, time.monotonic()
        engine.run("run", "-d", "--name", self.name, "--network", network, "--no-healthcheck",
                   *options, image, *command)

    def state(self):
        return json.loads(self.engine.run("inspect", self.name))[0]["State"]

    def running(self):
        return self.state()["Running"]

    def logs(self):
        done = subprocess.run([*self.engine.command, "logs", self.name], text=True, check=False,
                              env=self.engine.environment, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT)
        return done.stdout

    def execute(self, *command, allowed=(0,)):
        return self.engine.run("exec", self.name, *command, allowed=allowed)

    def kill(self, signal):
        self.engine.run("kill", "--signal", signal, self.name)

    def stop(self, patience=60):
        """SIGTERM; answers the exit status."""
        self.engine.run("stop", "-t", patience, self.name, timeout=patience + 60)
        return self.state()["ExitCode"]

    def start(self):
        self.starts, self.started = self.starts + 1, time.monotonic()
        self.engine.run("start", self.name)

    def remove(self):
        self.engine.run("rm", "-f", "-v", self.name)

    def wait(self, timeout=60):
        """Until it has ended; answers the exit status."""
        return int(self.engine.run("wait", self.name, timeout=timeout))


class ServerContainer(Container):
    """vantaged on a free port of this machine's loopback, hardened as the documents say."""

    def __init__(self, engine, image, volume, *flags, options=()):
        super().__init__(
            engine, image, "--listen", "127.0.0.1:0", *flags,
            options=(*self.hardened(engine), "-v", f"{volume}:/data", *options))

    @staticmethod
    def hardened(engine):
        return ("--read-only", "--cap-drop=ALL", "--security-opt=no-new-privileges",
                *(["--read-only-tmpfs=false"] if engine.name == "podman" else []))

    def address(self, patience=60):
        """The port where it listens since it was started last."""
        deadline = time.monotonic() + patience
        while time.monotonic() < deadline:
            found = re.findall(r"^vantaged \S+ listening on (\S+:\d+)$", self.logs(), re.MULTILINE)
            if len(found) >= self.starts:
                return found[-1]
            if not self.running():
                break
            time.sleep(0.05)
        raise Failed(f"{self.name} does not listen:\n{self.logs()}")

    def http_port(self):
        """Of /metrics and the probes, since it was started last."""
        lines = [json.loads(line) for line in self.logs().splitlines() if line.startswith("{")]
        return [line["port"] for line in lines if line["message"] == "serving HTTP"][-1]
