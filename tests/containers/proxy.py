"""HAProxy on this machine, with the delivered configuration, before a server in a container."""

import os
import pathlib
import shutil
import socket
import subprocess

from engine import ROOT

HAPROXY = shutil.which("haproxy", path=os.environ["PATH"] + ":/usr/sbin")
# The user of the image: haproxy may open its socket as one of its group, or as root.
IMAGE_USER = 10001


def socket_folder(folder):
    """A folder to mount where the server makes its socket; only root can give it to the server."""
    folder = pathlib.Path(folder)
    folder.mkdir(exist_ok=True)
    os.chown(folder, IMAGE_USER, IMAGE_USER)
    folder.chmod(0o750)
    return folder


class Proxy:
    """Listens on ports of its own. `certificate`: PEM of certificate and key; `authorities`: of
    what signs certificates of clients; `server`: its socket; `http`: HOST:PORT of its HTTP."""

    def __init__(self, folder, certificate, authorities, server, http):
        self.folder = pathlib.Path(folder)
        (self.folder / "clients").mkdir(parents=True)
        for name, text in zip(("tls.crt", "tls.key"), certificate):
            (self.folder / name).write_bytes(text)
        for number, text in enumerate(authorities):
            (self.folder / "clients" / f"{number}.pem").write_bytes(text)
        # Handed down, so that the ports are free for certain.
        listeners = [socket.create_server(("127.0.0.1", 0), backlog=128) for _ in range(2)]
        self.address, self.metrics = (f"127.0.0.1:{one.getsockname()[1]}" for one in listeners)
        with open(self.folder / "log", "wb") as log:
            self.process = subprocess.Popen(
                [HAPROXY, "-db", "-f", ROOT / "deploy" / "haproxy" / "haproxy.cfg"],
                pass_fds=[one.fileno() for one in listeners], stdin=subprocess.DEVNULL,
                stdout=log, stderr=log, env={
                    "PATH": os.environ["PATH"], "VANTAGE_CERTS": str(self.folder),
                    "VANTAGE_CLIENTS": str(self.folder / "clients"),
                    "VANTAGE_BIND": f"fd@{listeners[0].fileno()}",
                    "HAPROXY_METRICS": f"fd@{listeners[1].fileno()}",
                    "VANTAGE_SERVER": f"unix@{server}", "VANTAGE_HTTP": http,
                    "VANTAGE_WEB": f"unix@{pathlib.Path(server).with_name('web.sock')}"})
        for one in listeners:
            one.close()

    def log(self):
        return (self.folder / "log").read_text()[:1500]

    def end(self):
        self.process.terminate()
        try:
            self.process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
