"""The pods of deploy/kubernetes, as containers: image, arguments, mounts, user, probes."""

import contextlib
import os
import shutil
import subprocess
import time
import urllib.request

import job as jobs
import yaml
from engine import ROOT, Container, ServerContainer
from harness import FIRST_SCAN, house, open_house, say, state_of
from proxy import HAPROXY, Proxy, socket_folder
from secured_tests import SecuredContainerTest


def setUpModule():
    open_house()


def described_server(spec):
    server, = (one for one in spec["containers"] if one["name"] == "vantaged")
    return server


class PodContainer(ServerContainer):
    """The server of what a StatefulSet's template describes. `mounts`: a folder or volume by the
    mount's name."""

    def __init__(self, engine, image, spec, mounts):
        described = described_server(spec)
        user = spec["securityContext"]
        given = described["securityContext"]
        assert given["readOnlyRootFilesystem"] and not given["allowPrivilegeEscalation"]
        assert given["capabilities"] == {"drop": ["ALL"]}
        options = [*self.hardened(engine), "--user", f"{user['runAsUser']}:{user['runAsGroup']}"]
        for mount in described["volumeMounts"]:
            access = "ro" if mount.get("readOnly") else "rw"
            options += ["-v", f"{mounts[mount['name']]}:{mount['mountPath']}:{access}"]
        if "command" in described:
            options += ["--entrypoint", described["command"][0]]
        Container.__init__(self, engine, image,
                           *described.get("command", [])[1:], *described.get("args", []),
                           options=options)

    def address(self, patience=60):
        return super().address(patience).replace("0.0.0.0", "localhost")


class PodTest(SecuredContainerTest):
    def documents(self, folder):
        """By kind; what kustomize adds to the base are labels and the proxy's configuration."""
        if folder == "base":
            files = (ROOT / "deploy" / "kubernetes" / "base").glob("*.yaml")
            text = "\n---\n".join(file.read_text() for file in files)
        elif shutil.which("kubectl"):
            text = subprocess.run(["kubectl", "kustomize", ROOT / "deploy" / "kubernetes" / folder],
                                  text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                  check=True).stdout
        else:
            self.skipTest("kubectl is not installed")
        return {part["kind"]: part for part in yaml.safe_load_all(text)}

    def pod(self, folder):
        parts = self.documents(folder)
        spec = parts["StatefulSet"]["spec"]["template"]["spec"]
        secrets = {"vantage-tls": {"tls.crt": self.authority.read("server.pem"),
                                   "tls.key": self.authority.read("server.key")},
                   "vantage-callers": {"callers": self.authority.read("callers")}}
        # Ports of its own: this machine's network is used.
        config = parts["ConfigMap"]["data"]["vantaged.toml"]
        for port in ("7465",) if folder == "base" else ("7464", "7465"):
            self.assertIn(f'"0.0.0.0:{port}"', config)
            config = config.replace(f'"0.0.0.0:{port}"', '"0.0.0.0:0"')
        mounts = {claim["metadata"]["name"]: house.engine.new_volume()
                  for claim in parts["StatefulSet"]["spec"]["volumeClaimTemplates"]}
        own = {mount["name"] for mount in described_server(spec)["volumeMounts"]}
        for volume in spec["volumes"]:
            if volume["name"] not in own:
                continue  # the proxy's
            if "emptyDir" in volume:
                mounts[volume["name"]] = socket_folder(self.folder / volume["name"])
                continue
            files = (secrets[volume["secret"]["secretName"]] if "secret" in volume
                     else {"vantaged.toml": config.encode()})
            place = self.folder / folder / volume["name"]
            place.mkdir(parents=True)
            for name, content in files.items():
                (place / name).write_bytes(content)
                (place / name).chmod(0o644)
            mounts[volume["name"]] = place
        pod = PodContainer(house.engine, house.image, spec, mounts)
        self.addCleanup(pod.remove)
        return pod, spec

    def probe(self, probe, pod):
        if "grpc" in probe:
            return jobs.healthy(pod.address())
        page = f"http://127.0.0.1:{pod.http_port()}{probe['httpGet']['path']}"
        with urllib.request.urlopen(page, timeout=10) as answer:
            return answer.status == 200

    def until_ready(self, pod, spec):
        """Seconds until the startup probe of the server finds it so."""
        probe = described_server(spec)["startupProbe"]
        while True:
            with contextlib.suppress(OSError, IndexError):
                if self.probe(probe, pod):
                    return time.monotonic() - pod.started
            self.assertTrue(pod.running(), pod.logs())
            self.assertLess(time.monotonic() - pod.started, 60, "still not ready")
            time.sleep(0.05)

    def proxy(self, pod):
        """In place of the pod's own, whose image no registry in reach may have."""
        if not HAPROXY:
            self.skipTest("haproxy is not installed")
        proxy = Proxy(self.folder / "proxy",
                      [self.authority.read("server.pem"), self.authority.read("server.key")], [],
                      self.folder / "socket" / "vantaged.sock", f"127.0.0.1:{pod.http_port()}")
        self.addCleanup(proxy.end)
        deadline = time.monotonic() + 30
        while not jobs.healthy(proxy.address, self.authority.credentials()):
            self.assertLess(time.monotonic(), deadline, proxy.log())
            time.sleep(0.05)
        return proxy.address

    def check(self, folder, credentials):
        if folder == "base" and os.geteuid() != 0:
            self.skipTest("only root can give the container's user a folder for its socket")
        pod, spec = self.pod(folder)
        took = self.until_ready(pod, spec)
        for name in ("startupProbe", "readinessProbe", "livenessProbe"):
            self.assertTrue(self.probe(described_server(spec)[name], pod), name)
        address = self.proxy(pod) if folder == "base" else pod.address()
        job = self.job_of("tablet", address, credentials)
        job.create()
        self.assertEqual(state_of(job.push(FIRST_SCAN)), "SCAN_STATE_MERGED")
        self.assertEqual(state_of(job.plan()), "PLAN_STATE_SUCCEEDED")
        self.assertEqual(pod.stop(spec["terminationGracePeriodSeconds"]), 0)
        say(f"{folder}: serving after {took:.1f} s, probed, one scan planned after, drained")

    def test_base(self):
        self.check("base", self.authority.credentials())

    def test_where_a_mesh_encrypts(self):
        self.check("mesh", None)
