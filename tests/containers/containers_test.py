#!/usr/bin/python3
"""Starts containers from the image and drives them from outside, with an independent gRPC client.

Usage: containers_test.py [-v] [TESTS]. Environment: VANTAGE_PACKAGES, the folder of the Debian
packages to make the image from (default: build/package); VANTAGE_ENGINE, podman (default) or
docker; VANTAGE_BASE, an image to start from; without, one is made of Debian's packages.
VANTAGE_IMAGE, an image of the server that is there already, and tested instead of one made now.
"""

import json
import math
import os
import pathlib
import re
import subprocess
import sys
import time
import unittest

try:
    import grpc
    import job as jobs
except ImportError as missing:
    sys.exit(f"{missing} (Debian: python3-grpcio, python3-protobuf)")
import room_scan
from engine import FOLDER, ROOT, Container, Failed
from harness import (FIRST_SCAN, PACKAGES, PARTS, ContainerTest, house, name_of, open_house, package, say,
                     state_of)
from library_tests import LibraryTest  # noqa: F401
from pod_tests import PodTest  # noqa: F401
from secured_tests import ProxyTest, TlsTest  # noqa: F401, run as the others


def setUpModule():
    open_house()


class ImageTest(ContainerTest):
    def files(self):
        """Everything in the image, by an export of a container that never ran."""
        name = f"{house.engine.prefix}-export"
        house.engine.run("create", "--name", name, house.image)
        try:
            listed = subprocess.run(
                f"{' '.join(house.engine.command)} export {name} | tar -tf -", shell=True,
                text=True, env=house.engine.environment, stdout=subprocess.PIPE, check=True).stdout
        finally:
            house.engine.run("rm", "-f", "-v", name)
        return ["/" + line.removeprefix("./").lstrip("/") for line in listed.splitlines()]

    def test_is_small_and_holds_only_what_the_server_loads(self):
        described = json.loads(house.engine.run("image", "inspect", house.image))[0]
        say(f"image: {described['Size'] / 1e6:.0f} MB")
        self.assertLess(described["Size"], 200e6)
        files = self.files()
        programs = [file for file in files
                    if re.match(r"^/(usr/)?s?bin/[^/]+$|^/usr/local/s?bin/[^/]+$", file)]
        self.assertEqual(programs, ["/usr/bin/vantaged"])
        for unwanted in (r"\.h(pp)?$", r"\.a$", r"/gcc", r"cc1", r"[Vv][Tt][Kk]", r"[Qq]t\d",
                         r"/apt", r"perl"):
            self.assertEqual([file for file in files
                              if re.search(unwanted, file) and "/usr/share/doc/" not in file
                              and "/var/lib/dpkg/" not in file], [], unwanted)

    def test_lists_its_packages(self):
        name = f"{house.engine.prefix}-sbom"
        house.engine.run("create", "--name", name, house.image)
        self.addCleanup(lambda: house.engine.run("rm", "-f", "-v", name))
        folder = pathlib.Path(house.engine.scratch())
        house.engine.run("cp", f"{name}:/usr/share/doc/vantage-server/sbom.spdx.json",
                         folder / "sbom")
        sbom = json.loads((folder / "sbom").read_text())
        self.assertEqual(sbom["spdxVersion"], "SPDX-2.3")
        for key in ("dataLicense", "SPDXID", "name", "documentNamespace", "creationInfo"):
            self.assertTrue(sbom[key], key)
        # What npm's packages brought into the page is listed, too, where there is a page.
        bundled = [part for part in sbom["packages"] if
                   part["externalRefs"][0]["referenceLocator"].startswith("pkg:npm/")]
        self.assertEqual("svelte" in {part["name"] for part in bundled},
                         "/usr/share/vantage/web/index.html" in self.files())
        self.assertEqual(len(sbom["relationships"]), len(sbom["packages"]))
        self.assertEqual(len({part["SPDXID"] for part in sbom["packages"]}), len(sbom["packages"]))
        sbom["packages"] = [part for part in sbom["packages"] if part not in bundled]
        listed = {part["name"]: part["versionInfo"] for part in sbom["packages"]}
        say(f"packages: {', '.join(f'{k} {v}' for k, v in sorted(listed.items()))}")
        for part in sbom["packages"]:
            self.assertRegex(part["SPDXID"], r"^SPDXRef-[A-Za-z0-9.-]+$")
            self.assertRegex(part["externalRefs"][0]["referenceLocator"],
                             r"^pkg:deb/(debian|vantage)/[a-z0-9.%B-]+@[^+:~]+"
                             r"\?arch=(amd64|arm64|all)&")
        # Each library in the image belongs to a package of the list, and each has its licence.
        files = self.files()
        house.engine.run("cp", f"{name}:/var/lib/dpkg/info", folder)
        owned = set()
        for package_name in listed:
            owned.update((folder / "info" / f"{package_name}.list").read_text().split())
            self.assertTrue({f"/usr/share/doc/{package_name}/copyright",
                             f"/usr/share/doc/{package_name}"} & set(files), package_name)
        libraries = [file for file in files if re.search(r"\.so(\.|$)", file)
                     and not file.startswith("/etc/")]
        self.assertGreater(len(libraries), 20)
        for library in libraries:
            self.assertTrue({library, library.removeprefix("/usr")} & owned, library)

    def test_says_what_it_is(self):
        config = json.loads(house.engine.run("image", "inspect", house.image))[0]["Config"]
        for label in ("title", "description", "licenses", "version"):
            self.assertTrue(config["Labels"][f"org.opencontainers.image.{label}"], label)
        self.assertEqual(config["User"], "10001:10001")
        self.assertEqual(list(config["Volumes"]), ["/data"])
        self.assertIn("7464/tcp", config["ExposedPorts"])
        described = json.loads(house.engine.run("image", "inspect", house.image))[0]
        check = (config.get("Healthcheck") or described.get("Healthcheck"))["Test"]
        self.assertEqual(check[:2], ["CMD", "/usr/bin/vantaged"])


class RunTest(ContainerTest):
    def test_is_ready_in_seconds(self):
        server = self.serve(house.engine.new_volume())
        took = self.until_serving(server)
        say(f"from run to SERVING: {took:.2f} s")
        self.assertLess(took, 20)
        server.execute("/usr/bin/vantaged", "--healthcheck", server.address())
        with self.assertRaisesRegex(Failed, "does not answer"):
            server.execute("/usr/bin/vantaged", "--healthcheck", "127.0.0.1:1")

    def test_whole_job(self):
        server = self.serve(house.engine.new_volume())
        job = self.started_job(server)
        before = job.coverage().area_at_density_m2
        plan = job.plan()
        self.assertEqual(state_of(plan), "PLAN_STATE_SUCCEEDED", plan.state_message)
        self.assertEqual(name_of(plan.result, "outcome"), "PLAN_OUTCOME_VIEWS")
        there = plan.result.views[0].position
        # The scanner is put there, turned by 25 degrees; what is believed of it is a bit off.
        true = [start + getattr(there, axis) for start, axis in zip(room_scan.FIRST, "xyz")]
        half = math.radians(25 + 2) / 2
        second = job.push(room_scan.encoded(true, heading=25, seed=2), {"pose": {
            "rotation": {"w": math.cos(half), "z": math.sin(half)},
            "translation": {"x": there.x + 0.05, "y": there.y - 0.04, "z": there.z + 0.02}}})
        self.assertEqual(state_of(second), "SCAN_STATE_MERGED", second.state_message)
        self.assertEqual(name_of(second, "pose_source"), "POSE_SOURCE_REGISTRATION")
        for axis in "xyz":
            self.assertAlmostEqual(getattr(second.pose.translation, axis), getattr(there, axis),
                                   delta=0.01, msg="we know where it stood")
        after = job.coverage().area_at_density_m2
        say(f"at density: {before:.1f} m2, then {after:.1f} m2; registered with an error bound of "
            f"{1000 * second.registration.verdict.error_bound_m:.1f} mm")
        self.assertGreater(after, before)
        again = job.plan()
        self.assertEqual(state_of(again), "PLAN_STATE_SUCCEEDED", again.state_message)
        self.assertEqual(again.result.model_version, 2)

    def test_root_is_read_only_and_nobody_is_privileged(self):
        server = self.serve(house.engine.new_volume())
        self.until_serving(server)
        status = pathlib.Path(f"/proc/{server.state()['Pid']}/status").read_text()
        fields = dict(line.split(":\t", 1) for line in status.splitlines() if ":\t" in line)
        self.assertEqual(fields["Uid"].split(), ["10001"] * 4)
        self.assertEqual(fields["Gid"].split(), ["10001"] * 4)
        self.assertEqual(int(fields["CapEff"], 16) | int(fields["CapBnd"], 16), 0)
        self.assertEqual(fields["NoNewPrivs"], "1")
        for folder in ("/tmp/x", "/etc/vantage/x", "/var/x", "/x"):
            with self.assertRaisesRegex(Failed, "(?i)read-only file system"):
                server.execute("/usr/bin/vantaged", "--data", folder, "--listen", "127.0.0.1:0")
        self.started_job(server).plan()
        self.assertEqual(server.stop(), 0)
        # The engine's own, over the root.
        mounts = ("/data", "/dev", "/proc", "/sys", "/etc", "/run")
        changed = [line for line in house.engine.run("diff", server.name).splitlines()
                   if not line.split(" ", 1)[1].startswith(mounts)]
        self.assertEqual(changed, [])


class KeepingTest(ContainerTest):
    def test_restart_with_the_volume_kept(self):
        volume = house.engine.new_volume()
        server = self.serve(volume)
        job = self.started_job(server)
        plan = job.plan()
        state = job.get()
        self.assertEqual(server.stop(), 0)
        server.remove()
        successor = self.serve(volume)
        say(f"from run to SERVING with a job to load: {self.until_serving(successor):.2f} s")
        job = self.job(successor)
        self.assertEqual(job.get().last_sequence, state.last_sequence)
        self.assertEqual([scan.sha256 for scan in job.scans()],
                         [jobs.hashlib.sha256(FIRST_SCAN).digest()])
        self.assertEqual(jobs.what_was_planned(planned_when_loaded(job)),
                         jobs.what_was_planned(plan))

    def test_kill_9_in_the_middle_of_an_upload(self):
        server = self.serve(house.engine.new_volume())
        job = self.started_job(server)
        plan = job.plan()
        second = room_scan.encoded((2.6, 2.4, 1.5), heading=10, seed=3)
        prior = {"pose": {"rotation": {"w": 1}, "translation": {"x": 0.8, "y": 0.5}}}
        upload = job.send(job.open_upload(second, prior), second, pieces=3)
        self.assertGreater(upload.next_sequence, 0)
        server.kill("KILL")
        self.assertEqual(server.wait(), 137)
        server.start()
        self.until_serving(server)
        job = self.job(server)
        kept = job.client.call(jobs.SCANS, "GetUpload", {"name": upload.name}).upload
        self.assertGreaterEqual(kept.next_offset, upload.next_offset, "acknowledged, then lost")
        self.assertEqual(jobs.what_was_planned(planned_when_loaded(job)),
                         jobs.what_was_planned(plan))
        upload = job.send(kept, second)
        scan = job.decided(upload.scan)
        self.assertEqual(scan.sha256, jobs.hashlib.sha256(second).digest())
        self.assertEqual(state_of(scan), "SCAN_STATE_MERGED", scan.state_message)

    def test_memory_limit(self):
        # At the limit a scan waits, and says why; whatever happens, nothing is lost.
        volume = house.engine.new_volume()
        server = self.serve(volume, options=("--memory", "128m", "--memory-swap", "128m"))
        job = self.job(server)
        job.create()
        kept, ended = [], None
        for seed in range(1, 40):
            scan = room_scan.encoded(room_scan.FIRST, heading=3 * seed, step=2, seed=seed)
            half = math.radians(3 * seed) / 2
            prior = {"pose": {"rotation": {"w": math.cos(half), "z": math.sin(half)},
                              "translation": {}}} if kept else None
            try:
                upload = job.send(job.open_upload(scan, prior), scan)
                kept.append(jobs.hashlib.sha256(scan).digest())
                waits = job.decided_or_waiting(upload.scan).state_message
            except grpc.RpcError as error:
                self.assertEqual(error.code(), grpc.StatusCode.UNAVAILABLE)
                self.assertEqual(server.wait(), 137)
                ended = "killed"
                break
            if "memory" in waits:
                ended = f"one waits ({waits})"
                break
        self.assertIsNotNone(ended)
        say(f"at 128 MB, with {len(kept)} scans acknowledged: {ended}")
        self.assertGreater(len(kept), 1)
        server.remove()
        successor = self.serve(volume, options=("--memory", "2g"))
        self.until_serving(successor)
        scans = self.job(successor).scans()
        found = [scan.sha256 for scan in scans]
        self.assertEqual(found[:len(kept)], kept)
        self.assertLessEqual(len(found), len(kept) + 1, "one whose answer was lost")
        # With room, what waited is merged.
        self.assertEqual(state_of(self.job(successor).decided(scans[len(kept) - 1].name)),
                         "SCAN_STATE_MERGED")

    def test_sigterm_ends_a_plan_and_keeps_it(self):
        server = self.serve(house.engine.new_volume())
        job = self.started_job(server, density=2000)
        made = job.start_plan(timeBudget="600s", seed="7")
        watched = job.client.watch(jobs.PLANS, "WatchPlan", {"name": made.name}, timeout=120)
        for response in watched:
            self.assertFalse(response.last)
            if response.plan.result.views:
                break
        begun = time.monotonic()
        self.assertEqual(server.stop(), 0)
        say(f"SIGTERM to exit 0, a plan running: {time.monotonic() - begun:.1f} s")
        server.start()
        self.until_serving(server)
        ended = self.job(server).client.call(jobs.PLANS, "GetPlan", {"name": made.name}).plan
        self.assertEqual(state_of(ended), "PLAN_STATE_SUCCEEDED")
        self.assertIn("the server shuts down", ended.state_message)
        self.assertEqual(name_of(ended.result, "outcome"), "PLAN_OUTCOME_VIEWS")
        self.assertGreater(len(ended.result.views), 0)


def commands_of(heading):
    """The commands that deploy/README.md shows under a heading, as a shell takes them."""
    page = (ROOT / "deploy" / "README.md").read_text()
    part, = re.findall(rf"^#+ {heading}$(.*?)(?=^#+ |\Z)", page, re.MULTILINE | re.DOTALL)
    return [line.strip() for line in part.splitlines() if line.startswith("    ")]


def planned_when_loaded(job):
    """The plan of a job that was just loaded: its model may still be on its way."""
    deadline = time.monotonic() + 60
    while True:
        try:
            return job.plan()
        except grpc.RpcError as error:
            if error.code() != grpc.StatusCode.UNAVAILABLE or time.monotonic() > deadline:
                raise
            pushback = dict(error.trailing_metadata() or ()).get("grpc-retry-pushback-ms", "50")
            time.sleep(int(pushback) / 1000)


class InstallTest(ContainerTest):
    """Without our image: the packages on a bare Debian, and cmake --install."""

    def booted(self):
        """A container that systemd runs, with loopback alone for a network."""
        installed = house.engine.build("installed", FOLDER / "installed.Dockerfile", PACKAGES,
                                       BASE=house.base)
        options = (["--systemd=always"] if house.engine.name == "podman" else
                   ["--tmpfs=/run", "--tmpfs=/tmp", "--volume=/sys/fs/cgroup:/sys/fs/cgroup:rw"])
        container = Container(house.engine, installed, "/lib/systemd/systemd", network="none",
                              options=("--privileged", *options))
        self.addCleanup(container.remove)
        deadline = time.monotonic() + 60
        while True:
            state = container.execute("systemctl", "is-system-running", allowed=(0, 1))
            if state in ("running", "degraded"):
                return container
            if not container.running() or time.monotonic() > deadline:
                self.skipTest(f"systemd does not boot in a container here: {container.logs()}")
            time.sleep(0.1)

    def test_packages_under_systemd(self):
        container = self.booted()

        def shell(script):
            return container.execute("sh", "-ec", script)
        # Enabled and started by its installation, as delivered.
        self.assertEqual(shell("systemctl is-enabled vantaged; systemctl is-active vantaged"),
                         "enabled\nactive", container.execute("journalctl", "--no-pager"))
        self.assertEqual(shell("dpkg-query -W -f '${Conffiles}' vantage-server").split()[0],
                         "/etc/vantage/vantaged.toml")
        status = shell("cat /proc/$(systemctl show -p MainPID --value vantaged)/status")
        fields = dict(line.split(":\t", 1) for line in status.splitlines() if ":\t" in line)
        user = shell("id -u vantage")
        self.assertEqual(fields["Uid"].split(), [user] * 4)
        self.assertEqual(int(fields["CapBnd"], 16), 0)
        self.assertEqual(fields["Seccomp"], "2")
        # The whole job under all that hardening, by the packaged client.
        shell("vantage health")
        job = shell("vantage simulate --step 2 --density 100 --scans 2 --session flat --no-hints")
        say("under systemd: " + job.splitlines()[-1].strip())
        self.assertRegex(shell("vantage scan list flat"), "(?s)scan-1.*merged.*scan-2.*merged")
        self.assertEqual(shell("stat -c '%U %a' /var/lib/vantage"), "vantage 700")
        # Stopped it drains; started again it has what it had; killed it comes back.
        shell("systemctl stop vantaged")
        self.assertEqual(shell("systemctl show -p Result --value vantaged"), "success")
        shell("systemctl start vantaged; vantage scan list flat | grep -q scan-2")
        shell("systemctl kill -s KILL vantaged; "
              "for i in $(seq 100); do vantage health 2>/dev/null && exit 0; sleep 0.2; done; "
              "exit 1")
        self.check_proxy_under_systemd(shell)
        self.check_field(shell)
        # A changed configuration outlives the package; the data outlive its configuration.
        shell("echo '# mine' >>/etc/vantage/vantaged.toml; apt-get -q remove -y vantage-server; "
              "grep -q mine /etc/vantage/vantaged.toml; test ! -e /usr/bin/vantaged")
        shell("dpkg --purge vantage-server; test ! -e /etc/vantage/vantaged.toml; "
              "test -s /var/lib/vantage/logs.sqlite")

    def check_field(self, shell):
        """A crew's laptop, beside the service: the page, the libraries and the client are there."""
        shell("systemd-run --unit=site --collect vantaged field --data /tmp/site --port 7543; "
              "for i in $(seq 100); do journalctl -u site | grep -q '#token=' && exit 0; "
              "sleep 0.2; done; journalctl -u site; exit 1")
        told = shell("journalctl -u site -o cat")
        self.assertIn("https://127.0.0.1:7543/#token=", told)
        self.assertIn("no network", told)
        command, = re.findall(r"^ *(vantage --server .*)$", told, re.MULTILINE)
        shell(command.replace("session list", "session create site"))
        self.assertIn("site", shell(command))
        shell("vantaged field pair two --data /tmp/site | grep -q '#token='; "
              "systemctl stop site; test -s /tmp/site/field/authority.crt")

    def check_proxy_under_systemd(self, shell):
        """Not started without a certificate; with one and callers, by the page's own commands."""
        self.assertEqual(shell("systemctl is-enabled vantage-proxy; "
                               "systemctl is-active vantage-proxy || true"), "enabled\ninactive")
        commands = commands_of("Callers from elsewhere")
        self.assertGreater(len(commands), 3)
        shell("cd /root; openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes "
              "-days 2 -subj /CN=localhost -addext subjectAltName=DNS:localhost "
              "-keyout server.key -out server.pem; cp server.pem clients-authority.pem")
        shell("cd /root; sudo() { \"$@\"; }\n" + "\n".join(commands))
        self.assertEqual(shell("systemctl is-active vantage-proxy vantaged"), "active\nactive",
                         shell("journalctl --no-pager -u vantage-proxy | tail -30"))
        self.assertEqual(shell("stat -c '%U:%G %a' /run/vantage /run/vantage/*.sock"),
                         "vantage:vantage 750\nvantage:vantage 660\nvantage:vantage 660")
        # Through the proxy with the token that was made; whoever else is refused.
        through = ("vantage --server localhost:7443 --tls-ca /root/server.pem --timeout 20 "
                   "--token-file /root/tablet-7.token")
        shell(f"for i in $(seq 50); do {through} session list && exit 0; sleep 0.2; done; exit 1")
        # A browser has the page, where the package has it, and may not call without a token.
        by_web = ("printf '%s HTTP/1.1\\r\\nHost: localhost\\r\\nConnection: close\\r\\n{}\\r\\n' '{}' | "
                  "openssl s_client -quiet -verify_quiet -connect localhost:7443 "
                  "-CAfile /root/server.pem 2>/dev/null")
        page = shell(by_web.format("", "GET /"))
        has_page = shell("test -e /usr/share/vantage/web/index.html && echo yes || echo no") == "yes"
        self.assertIn(" 200 " if has_page else " 404 ", page.splitlines()[0])
        self.assertEqual(has_page, "<!doctype html>" in page)
        refused = shell(by_web.format("Content-Type: application/json\\r\\nContent-Length: 0\\r\\n",
                                      "POST /vantage.v1.SessionService/ListSessions"))
        self.assertIn(" 4", refused.splitlines()[0])
        shell("! setpriv --reuid=nobody --clear-groups vantaged --healthcheck "
              "unix:/run/vantage/vantaged.sock")

    def test_cmake_installs_what_the_packages_hold(self):
        tree = ROOT / "build" / "release"
        if not (tree / "CMakeCache.txt").exists():
            self.skipTest(f"no build in {tree}")
        root = pathlib.Path(house.engine.scratch())
        def installed():
            subprocess.run(["cmake", "--install", tree, "--prefix", "/usr", "--strip"], check=True,
                           env=os.environ | {"DESTDIR": str(root)}, stdout=subprocess.DEVNULL)
            return {str(path.relative_to(root)) for path in root.rglob("*") if path.is_file()}
        packaged = set()
        for name in PARTS:
            listed = subprocess.run(["dpkg-deb", "-c", package(name)], text=True, check=True,
                                    stdout=subprocess.PIPE).stdout
            packaged |= {line.split()[-1].removeprefix("./") for line in listed.splitlines()
                         if not line.startswith("d")}
        self.assertEqual(installed(), packaged)
        # Installed again, a changed configuration stays.
        config = root / "etc/vantage/vantaged.toml"
        config.write_text("threads = 1\n")
        installed()
        self.assertEqual(config.read_text(), "threads = 1\n")
        version = subprocess.run([root / "usr/bin/vantaged", "--version"], text=True, check=True,
                                 stdout=subprocess.PIPE).stdout
        self.assertIn(version.split()[1], package("server").name)


if __name__ == "__main__":
    unittest.main()
