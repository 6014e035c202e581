#!/usr/bin/python3
"""Checks what the server is deployed with: Kubernetes, Compose, HAProxy, systemd.

Usage: deploy_test.py [-v] [TESTS]. Environment: VANTAGE_BUILD, where vantaged is built (default:
build/release); VANTAGE_NODE, where the npm packages typescript and kubernetes-types are (default:
build/node-deploy). Each tool is first shown something wrong, so that its consent means something.
"""

import json
import os
import pathlib
import re
import resource
import shutil
import socket
import subprocess
import sys
import tempfile
import tomllib
import unittest

try:
    import yaml
except ImportError as missing:
    sys.exit(f"{missing} (Debian: python3-yaml)")

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
DEPLOY = ROOT / "deploy"
BUILD = pathlib.Path(os.environ.get("VANTAGE_BUILD", ROOT / "build" / "release")).resolve()
NODE = (pathlib.Path(os.environ.get("VANTAGE_NODE", ROOT / "build" / "node-deploy")).resolve() /
        "node_modules")
EXPOSURE = 15  # tenths, as systemd-analyze security counts: 0 best, 100 worst
PATH = os.environ["PATH"] + ":/usr/sbin"


def run(*command, **how):
    return subprocess.run([str(part) for part in command], text=True, stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
                          **{"env": os.environ | {"PATH": PATH}, **how})


def options_of_vantaged():
    text = run(BUILD / "server" / "vantaged", "--help").stdout
    found = set(re.findall(r"^\s+(?:-\w,)?--([a-z][a-z-]*)", text, re.MULTILINE))
    assert "listen" in found and "data" in found, text
    return found


class DeployTest(unittest.TestCase):
    def scratch(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        return pathlib.Path(folder.name)

    def needs(self, tool):
        if not shutil.which(tool, path=PATH):
            self.skipTest(f"{tool} is not installed")

    def assertKnown(self, options):
        self.assertEqual(set(options) - options_of_vantaged(), set(), "options of vantaged")


def toml_keys(text):
    """The keys that are set, and those that a comment shows."""
    return re.findall(r"^(?:# )?([a-z][a-z-]*) = ", text, re.MULTILINE)


class ConfigurationTest(DeployTest):
    def test_default_configuration_has_known_keys(self):
        keys = toml_keys((DEPLOY / "vantaged.toml").read_text())
        self.assertGreater(len(keys), 4)
        self.assertKnown(keys)

    def test_the_page_makes_it_listen_for_the_proxy(self):
        """The command of README.md uses the lines that vantaged.toml shows, and no others."""
        command, = re.findall(r"^    sudo (sed .*) /etc/vantage/vantaged.toml$",
                              (DEPLOY / "README.md").read_text(), re.MULTILINE)
        file = self.scratch() / "vantaged.toml"
        shutil.copy(DEPLOY / "vantaged.toml", file)
        before = tomllib.loads(file.read_text())
        done = run("sh", "-c", f'{command} "$0"', file)
        self.assertEqual((done.returncode, done.stdout), (0, ""))
        after = tomllib.loads(file.read_text())
        self.assertEqual({key: after[key] for key in after if after[key] != before.get(key)}, {
            "listen": ["127.0.0.1:7464", "unix:/run/vantage/vantaged.sock"],
            "web": "unix:/run/vantage/web.sock",
            "callers": "/etc/vantage/callers", "certificate-metadata": "x-client-certificate",
            "address-metadata": "x-forwarded-for"})
        self.assertEqual(before.keys() - after.keys(), set())
        # The server takes it as far as the callers, who are not there.
        done = run(BUILD / "server" / "vantaged", "--config", file, "--in-memory")
        self.assertEqual(done.returncode, 2)
        self.assertIn("/etc/vantage/callers", done.stdout)

    def test_server_and_proxy_agree(self):
        """What haproxy.cfg sends is what the server is told to believe, wherever it is deployed."""
        proxy = (DEPLOY / "haproxy" / "haproxy.cfg").read_text()
        package = (DEPLOY / "vantaged.toml").read_text()
        pod = yaml.safe_load((DEPLOY / "kubernetes/base/config.yaml").read_text())
        compose = yaml.safe_load((DEPLOY / "compose/compose.yaml").read_text())
        described = {"package": re.findall(r'^# ((?:listen|web|certificate-|address-).*)$', package,
                                           re.MULTILINE),
                     "pod": pod["data"]["vantaged.toml"].splitlines(),
                     "compose": compose["services"]["vantaged"]["command"]}
        path, = re.findall(r"VANTAGE_SERVER-unix@(\S+)}", proxy)
        web, = re.findall(r"VANTAGE_WEB-unix@(\S+)}", proxy)
        certificate, = re.findall(r"set-header (\S+) %\[ssl_c_der,base64\]", proxy)
        address, = re.findall(r"set-header (\S+) %\[src\]", proxy)
        # Whatever of that name came from outside is gone first.
        self.assertLess(proxy.index(f"del-header {certificate}\n"),
                        proxy.index(f"set-header {certificate} "))
        for where, lines in described.items():
            for key, value in (("listen", f"unix:{path}"), ("web", f"unix:{web}"),
                               ("certificate-metadata", certificate), ("address-metadata", address)):
                self.assertTrue([line for line in lines if key in line and value in line],
                                (where, key, value))
        port, = re.findall(r"VANTAGE_HTTP-127.0.0.1:(\d+)}", proxy)
        self.assertIn(f'http = "127.0.0.1:{port}"', package)
        self.assertIn(f'http = "0.0.0.0:{port}"', pod["data"]["vantaged.toml"])


class LicencesTest(DeployTest):
    """What npm's packages bring into the page is named where a package and an image say what they hold."""
    PAGE = ROOT / "build" / "web" / "licences.txt"
    # Of the package's own list, by another way than the one that licences.txt is made by: these are
    # in the page or it could not be.
    WRITTEN_WITH = ("svelte", "@connectrpc/connect-web", "@connectrpc/connect", "@bufbuild/protobuf",
                    "@noble/hashes")

    def page(self):
        """Names and versions of the packages, as the lock file has them, and licences.txt."""
        if not self.PAGE.exists():
            self.skipTest("the page was not built: ./dev build web")
        lock = json.loads((ROOT / "client/web/package-lock.json").read_text())["packages"]
        self.assertEqual(set(lock[""]["dependencies"]), set(self.WRITTEN_WITH))
        return ({name: lock[f"node_modules/{name}"]["version"] for name in self.WRITTEN_WITH},
                self.PAGE.read_text())

    def copyright(self, page):
        to = self.scratch() / "copyright"
        done = run("cmake", f"-DLICENSE={ROOT / 'LICENSE'}", f"-DPAGE={page}", f"-DTO={to}",
                   "-P", DEPLOY / "debian" / "copyright.cmake")
        self.assertEqual((done.returncode, done.stdout), (0, ""))
        return to.read_text()

    def test_copyright_names_what_is_in_the_page(self):
        packages, page = self.page()
        text = self.copyright(self.PAGE)
        licence = (ROOT / "LICENSE").read_text()
        self.assertTrue(text.startswith(licence))
        self.assertTrue(text.endswith(page))
        for name, version in packages.items():
            self.assertRegex(text, rf"(?m)^== {name} {version} \([A-Za-z0-9. -]+\)$")
        # One text for each kind that ours is not.
        for kind in ("Permission is hereby granted, free of charge", "Redistribution and use in source"):
            self.assertIn(kind, text)
        self.assertEqual(self.copyright(self.scratch() / "none"), licence)
        # It is what is installed.
        self.assertIn("copyright.cmake", (BUILD / "deploy" / "cmake_install.cmake").read_text())

    def sbom(self, root):
        done = subprocess.run(["sh", ROOT / "docker" / "sbom.sh", root, "vantage-server"], text=True,
                              stdout=subprocess.PIPE, check=True)
        return json.loads(done.stdout)

    def test_the_image_lists_what_is_in_the_page(self):
        self.needs("dpkg-query")
        packages, _ = self.page()
        root = self.scratch()
        for folder in ("var/lib/dpkg", "usr/bin", "usr/share/vantage/web"):
            (root / folder).mkdir(parents=True)
        (root / "usr/bin/vantaged").write_bytes(b"it")
        (root / "var/lib/dpkg/status").write_text(
            "".join(f"Package: {name}\nStatus: install ok installed\nVersion: {version}\n"
                    f"Architecture: amd64\nMaintainer: a\nDescription: b\n\n"
                    for name, version in (("vantage-server", "0.1.0"), ("libstdc++6", "12.2.0-14"))))
        without = self.sbom(root)
        self.assertEqual([part["name"] for part in without["packages"]], ["libstdc++6", "vantage-server"])
        shutil.copy(self.PAGE, root / "usr/share/vantage/web")
        sbom = self.sbom(root)
        self.assertEqual(sbom["packages"][:2], without["packages"])
        bundled = {part["name"]: part for part in sbom["packages"][2:]}
        for name, version in packages.items():
            part = bundled[name]
            self.assertEqual(part["versionInfo"], version)
            self.assertEqual(part["externalRefs"][0]["referenceLocator"],
                             f"pkg:npm/{name.replace('@', '%40')}@{version}")
            self.assertRegex(part["licenseDeclared"], r"^(MIT|Apache-2\.0( AND BSD-3-Clause)?)$")
        ids = [part["SPDXID"] for part in sbom["packages"]]
        self.assertEqual(len(set(ids)), len(ids))
        self.assertEqual([one["relatedSpdxElement"] for one in sbom["relationships"]], ids)
        for one in ids:
            self.assertRegex(one, r"^SPDXRef-[A-Za-z0-9.-]+$")


class KubernetesTest(DeployTest):
    GROUPS = {"v1": "core/v1", "apps/v1": "apps/v1", "networking.k8s.io/v1": "networking/v1",
              "policy/v1": "policy/v1"}

    def documents(self):
        """Those of the base, one by one as they stand, and what kustomize makes of each folder."""
        base = DEPLOY / "kubernetes" / "base"
        listed = yaml.safe_load((base / "kustomization.yaml").read_text())["resources"]
        files = [name for name in listed if not name.startswith("../")]
        self.assertEqual(sorted(files), sorted(path.name for path in base.glob("*.yaml")
                                               if path.name != "kustomization.yaml"))
        found = {"files": [document for name in files
                           for document in yaml.safe_load_all((base / name).read_text())]}
        if shutil.which("kubectl"):
            for folder in ("base", "mesh"):
                done = run("kubectl", "kustomize", DEPLOY / "kubernetes" / folder)
                self.assertEqual(done.returncode, 0, done.stdout)
                self.assertNotIn("deprecated", done.stdout)
                found[folder] = list(yaml.safe_load_all(done.stdout))
        else:
            print("  no kubectl: what kustomize makes of them is not checked", file=sys.stderr)
        return found

    def faults(self, documents):
        """What the API's own types find wrong in the documents: missing, unknown, another kind."""
        if not (NODE / "typescript").exists() or not (NODE / "kubernetes-types").exists():
            self.skipTest(f"typescript and kubernetes-types are not in {NODE}")
        lines = []
        for number, document in enumerate(documents):
            module = self.GROUPS[document["apiVersion"]]
            lines += [f'import type {{ {document["kind"]} as T{number} }} '
                      f'from "{NODE}/kubernetes-types/{module}";',
                      f"export const d{number}: T{number} = {json.dumps(document)};"]
        file = self.scratch() / "documents.ts"
        file.write_text("\n".join(lines))
        done = run("node", NODE / "typescript" / "bin" / "tsc", "--noEmit", "--strict",
                   "--target", "es2020", "--module", "es2020", "--moduleResolution", "node",
                   file)
        return "" if done.returncode == 0 else done.stdout or "tsc failed"

    def test_documents_are_what_the_api_takes(self):
        self.needs("node")
        found = self.documents()
        for where, documents in found.items():
            self.assertEqual(self.faults(documents), "", where)
        for wrong in ('"readinesProbe"', '"failureThreshold": "2"'):
            right = {'"readinesProbe"': '"readinessProbe"',
                     '"failureThreshold": "2"': '"failureThreshold": 2'}[wrong]
            text = json.dumps(found["files"])
            self.assertIn(right, text)
            self.assertNotEqual(self.faults(json.loads(text.replace(right, wrong))), "", wrong)

    def test_names_fit_together(self):
        for where, documents in self.documents().items():
            with self.subTest(where):
                self.check_names({(part["kind"], part["metadata"]["name"]): part
                                  for part in documents}, where)

    def check_names(self, parts, where):
        pods = parts["StatefulSet", "vantage"]["spec"]
        template = pods["template"]
        labels = template["metadata"]["labels"]
        spec = template["spec"]
        containers = {one["name"]: one for one in spec["containers"]}
        self.assertEqual(containers.keys(),
                         {"vantaged"} if where == "mesh" else {"vantaged", "proxy"})
        container = containers["vantaged"]
        ports = {port["name"]: port["containerPort"] for one in containers.values()
                 for port in one["ports"]}
        for (kind, name), part in parts.items():
            selector = {"Service": lambda s: s.get("selector"),
                        "StatefulSet": lambda s: s["selector"]["matchLabels"],
                        "NetworkPolicy": lambda s: s["podSelector"]["matchLabels"],
                        "PodDisruptionBudget": lambda s: s["selector"]["matchLabels"],
                        }.get(kind)
            if selector:
                wanted = selector(part["spec"])
                self.assertTrue(wanted and wanted.items() <= labels.items(), (kind, name))
        self.assertEqual(parts["Service", pods["serviceName"]]["spec"]["clusterIP"], "None")
        self.assertIn(("ServiceAccount", spec["serviceAccountName"]), parts)
        for name in ("vantage", "vantage-pods"):
            for port in parts["Service", name]["spec"]["ports"]:
                self.assertEqual(ports[port["targetPort"]], port["port"])
        for rule in parts["NetworkPolicy", "vantage"]["spec"]["ingress"]:
            self.assertLessEqual({port["port"] for port in rule["ports"]}, ports.keys())
            self.assertTrue(rule["from"])
        for name, one in containers.items():
            own = {port["name"]: port["containerPort"] for port in one["ports"]}
            probes = {key: value for key, value in one.items() if key.endswith("Probe")}
            self.assertIn("readinessProbe", probes, name)
            self.assertIn("livenessProbe", probes, name)
            for probe, asks in probes.items():
                kind, = asks.keys() & {"grpc", "httpGet", "tcpSocket"}
                self.assertIn(asks[kind]["port"], own.values() if kind == "grpc" else own, probe)
            self.assertTrue(one["securityContext"]["readOnlyRootFilesystem"])
            self.assertFalse(one["securityContext"]["allowPrivilegeEscalation"])
            self.assertEqual(one["securityContext"]["capabilities"], {"drop": ["ALL"]})
            self.assertIn("memory", one["resources"]["requests"])
        self.assertIn("startupProbe", container)
        self.assertEqual({claim["metadata"]["name"] for claim in pods["volumeClaimTemplates"]}
                         | {volume["name"] for volume in spec["volumes"]},
                         {mount["name"] for one in containers.values()
                          for mount in one["volumeMounts"]})
        self.assertTrue(spec["securityContext"]["runAsNonRoot"])
        for volume in spec["volumes"]:
            named = volume.get("configMap", {}).get("name", "vantage")
            if where != "files":
                self.assertIn(("ConfigMap", named), parts, "what is mounted is there")
        if "proxy" in containers:
            self.check_proxy(containers, spec, parts)
        # What the server reads lies below what is mounted, and its options are known.
        config = parts["ConfigMap", "vantage"]["data"]["vantaged.toml"]
        keys = toml_keys(config)
        self.assertKnown(keys)
        mounts = [mount["mountPath"] for mount in container["volumeMounts"]]
        for path in re.findall(r'"(?:unix:)?(/[^"]+)"', config):
            self.assertTrue(any(path.startswith(mount + "/") for mount in mounts), path)
        for port in re.findall(r'"0\.0\.0\.0:(\d+)"', config):
            self.assertIn(int(port), ports.values())
        drain = int(re.search(r"^drain-seconds = (\d+)", config, re.MULTILINE).group(1))
        self.assertGreater(spec["terminationGracePeriodSeconds"], drain)
        # Other machines are served by the proxy, or where it is said that others encrypt.
        self.assertEqual('listen = "unix:' in config, "allow-insecure-remote" not in keys)
        self.assertIn("callers", keys)

    def check_proxy(self, containers, spec, parts):
        """The proxy finds its files and the server's socket where its configuration looks."""
        proxy = containers["proxy"]
        mounts = {mount["mountPath"]: mount["name"] for mount in proxy["volumeMounts"]}
        given = {one["name"]: one["value"] for one in proxy["env"]}
        text = (DEPLOY / "haproxy" / "haproxy.cfg").read_text()
        # Its variables, with their defaults.
        known = dict(re.findall(r"\$\{([A-Z_]+)-([^}]*)\}", text))
        self.assertEqual(given.keys() - known.keys(), set())
        known.update(given)
        for name in ("VANTAGE_CERTS", "VANTAGE_CLIENTS"):
            self.assertIn(known[name], mounts)
        shared, = {mounts[os.path.dirname(known[name].removeprefix("unix@"))]
                   for name in ("VANTAGE_SERVER", "VANTAGE_WEB")}
        self.assertIn(shared, [mount["name"] for mount in containers["vantaged"]["volumeMounts"]])
        volumes = {volume["name"]: volume for volume in spec["volumes"]}
        self.assertIn("emptyDir", volumes[shared])
        # It may open the socket as one of the pod's group, and is another user.
        self.assertEqual(spec["securityContext"]["fsGroup"],
                         spec["securityContext"]["runAsGroup"])
        self.assertNotEqual(proxy["securityContext"]["runAsUser"],
                            spec["securityContext"]["runAsUser"])
        ports = {port["name"]: f":{port['containerPort']}" for port in proxy["ports"]}
        self.assertEqual((ports["grpc"], ports["metrics"]),
                         (known["VANTAGE_BIND"], known["HAPROXY_METRICS"]))
        config = [part for (kind, name), part in parts.items()
                  if kind == "ConfigMap" and name.startswith("vantage-proxy-")]
        for part in config:
            self.assertEqual(part["data"]["haproxy.cfg"], text)
            self.assertEqual(volumes[mounts[os.path.dirname(proxy["command"][-1])]]["configMap"],
                             {"name": part["metadata"]["name"]})


class ComposeTest(DeployTest):
    FOLDER = DEPLOY / "compose"

    def test_compose_takes_it(self):
        self.needs("docker-compose")
        text = (self.FOLDER / "compose.yaml").read_text()
        folder = self.scratch()
        for given, takes in ((text, True), (text.replace("stop_grace_period", "stop_grace"), False),
                             (text.replace("pids_limit", "pid_limit"), False)):
            (folder / "compose.yaml").write_text(given)
            done = run("docker-compose", "-f", folder / "compose.yaml", "--profile", "monitoring",
                       "config", "--quiet")
            self.assertEqual(done.returncode == 0, takes, done.stdout)

    def test_names_fit_together(self):
        described = yaml.safe_load((self.FOLDER / "compose.yaml").read_text())
        services = described["services"]
        flags = [flag[2:].split("=") for flag in services["vantaged"]["command"]]
        self.assertKnown([flag[0] for flag in flags])
        given = {flag[0]: flag[-1] for flag in flags}
        environment = services["haproxy"]["environment"]
        self.assertEqual(environment["VANTAGE_HTTP"], f"vantaged:{given['http'].split(':')[1]}")
        for name in environment:
            self.assertIn(f"${{{name}-", (DEPLOY / "haproxy" / "haproxy.cfg").read_text())
        # The socket lies in memory that both have, for the user of the image and its group.
        for name in ("vantaged", "haproxy"):
            for option in ("listen", "web"):
                self.assertIn("socket:" + os.path.dirname(given[option].removeprefix("unix:")),
                              services[name]["volumes"])
        group, = services["haproxy"]["group_add"]
        self.assertIn(f"gid={group}", described["volumes"]["socket"]["driver_opts"]["o"])
        self.assertIn(f"USER {group}:{group}", (ROOT / "docker" / "Dockerfile").read_text())
        self.assertTrue(described["networks"]["inside"]["internal"])
        self.assertEqual(services["vantaged"]["networks"], ["inside"])
        self.assertNotIn("ports", services["vantaged"])
        self.assertEqual(given["callers"], "/access/callers")
        for service in services.values():
            for volume in service["volumes"]:
                source = volume.split(":")[0]
                if source.startswith("."):
                    # Made by the operator, or delivered.
                    self.assertTrue(source in ("./access", "./certs")
                                    or (self.FOLDER / source).is_file(), source)
                else:
                    self.assertIn(source, described["volumes"])
        targets = {target for job in yaml.safe_load(
            (self.FOLDER / "prometheus.yml").read_text())["scrape_configs"]
            for config in job["static_configs"] for target in config["targets"]}
        self.assertEqual(targets, {f"vantaged:{given['http'].split(':')[1]}", "haproxy:8404"})


class HaproxyTest(DeployTest):
    CONFIGURATION = DEPLOY / "haproxy" / "haproxy.cfg"
    def environment(self, folder):
        """That of a proxy with a certificate of its own in `folder`, on ports that are free."""
        self.needs("haproxy")
        self.needs("openssl")
        done = run("openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt",
                   "ec_paramgen_curve:P-256", "-nodes", "-days", "1", "-subj", "/CN=localhost",
                   "-keyout", folder / "tls.key", "-out", folder / "tls.crt")
        self.assertEqual(done.returncode, 0, done.stdout)
        (folder / "clients").mkdir()
        return {"PATH": PATH, "VANTAGE_CERTS": str(folder),
                "VANTAGE_CLIENTS": str(folder / "clients"),
                "VANTAGE_SERVER": f"unix@{folder}/vantaged.sock"}

    def test_haproxy_takes_it(self):
        folder = self.scratch()
        environment = self.environment(folder)
        text = self.CONFIGURATION.read_text()

        def takes(given=text, **other):
            (folder / "haproxy.cfg").write_text(given)
            return run("haproxy", "-c", "-f", folder / "haproxy.cfg",
                       env=environment | other).returncode == 0
        self.assertTrue(takes())
        shutil.copy(folder / "tls.crt", folder / "clients" / "authority.pem")
        self.assertTrue(takes())
        self.assertFalse(takes(text.replace("timeout connect", "timeout conect")))
        self.assertFalse(takes(text.replace("default_backend vantaged", "default_backend v")))
        self.assertFalse(takes(VANTAGE_CLIENTS=str(folder / "none")))
        self.assertFalse(takes(VANTAGE_CERTS=str(folder / "none")))

    def limits(self):
        """The files that HAProxy may have open, by where it is deployed."""
        unit = (DEPLOY / "systemd" / "vantage-proxy.service").read_text()
        compose = yaml.safe_load((DEPLOY / "compose" / "compose.yaml").read_text())
        return {"unit": int(re.search(r"^LimitNOFILE=(\d+)$", unit, re.MULTILINE).group(1)),
                "compose": compose["services"]["haproxy"]["ulimits"]["nofile"]}

    def number(self, setting):
        """Of the section 'global'."""
        text = self.CONFIGURATION.read_text()
        return int(re.search(rf"^  {setting} (\d+)$", text, re.MULTILINE).group(1))

    def test_its_files_suffice(self):
        """'haproxy -c' does not count files, so it is started; it ends at once where it lacks some."""
        folder = self.scratch()
        environment = self.environment(folder)
        most = self.number("maxconn")

        def starts(files):
            listeners = [socket.create_server(("127.0.0.1", 0)) for _ in range(2)]
            ports = [one.fileno() for one in listeners]
            proxy = subprocess.Popen(
                ["haproxy", "-db", "-f", self.CONFIGURATION], pass_fds=ports,
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                env=environment | {"VANTAGE_BIND": f"fd@{ports[0]}",
                                   "HAPROXY_METRICS": f"fd@{ports[1]}"},
                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (files, files)))
            address = listeners[1].getsockname()
            for one in listeners:
                one.close()
            try:
                with socket.create_connection(address, timeout=20) as link:
                    link.sendall(b"GET /readyz HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")
                    answer = link.recv(1000)
                # Without a server behind it.
                self.assertTrue(answer in (b"",) or b" 503 " in answer or b" 200 " in answer)
                return answer != b""
            except OSError:
                return False
            finally:
                proxy.terminate()
                proxy.wait()
        for where, files in self.limits().items():
            self.assertTrue(starts(files), where)
        self.assertFalse(starts(2 * most + 20))

    def test_its_threads_may_be_started(self):
        compose = yaml.safe_load((DEPLOY / "compose" / "compose.yaml").read_text())
        self.assertGreater(compose["services"]["haproxy"]["pids_limit"], self.number("nbthread") + 2)


class SystemdTest(DeployTest):
    UNITS = ("vantaged", "vantage-proxy")

    def unit(self, change=lambda text: text, name="vantaged"):
        """The unit as a file, with the server where it is built."""
        text = (DEPLOY / "systemd" / f"{name}.service").read_text()
        file = self.scratch() / f"{name}.service"
        file.write_text(change(text.replace("/usr/bin/vantaged", str(BUILD / "server/vantaged"))))
        return file

    def test_units_are_understood(self):
        self.needs("systemd-analyze")
        self.needs("haproxy")
        for name in self.UNITS:
            done = run("systemd-analyze", "verify", "--man=no", self.unit(name=name))
            self.assertEqual((done.returncode, done.stdout), (0, ""), name)
            wrong = self.unit(lambda text: text.replace("LimitNOFILE=", "LimitFiles="), name)
            self.assertNotEqual(run("systemd-analyze", "verify", "--man=no", wrong).stdout, "")

    def test_the_proxy_opens_the_socket_and_no_more(self):
        """It is of the server's group, to which its folder of the socket is open and no other."""
        server = self.unit().read_text()
        proxy = self.unit(name="vantage-proxy").read_text()
        for line in ("Group=vantage", "RuntimeDirectory=vantage", "RuntimeDirectoryMode=0750",
                     "StateDirectoryMode=0700", "UMask=0077"):
            self.assertIn(f"\n{line}\n", server)
        for line in ("SupplementaryGroups=vantage", "User=vantage-proxy",
                     "ConditionPathExists=/etc/vantage/proxy/tls.crt"):
            self.assertIn(f"\n{line}\n", proxy)
        default, = re.findall(r"VANTAGE_CERTS-([^}]+)}",
                              (DEPLOY / "haproxy" / "haproxy.cfg").read_text())
        self.assertEqual(default, "/etc/vantage/proxy")
        made = (DEPLOY / "systemd" / "vantage.conf").read_text()
        installs = (DEPLOY / "debian" / "server" / "postinst").read_text()
        for user in self.UNITS:
            user = user.removesuffix("d")
            self.assertIn(f"\nu {user} ", made)
            self.assertRegex(installs, rf"adduser --system --group [^;]*? {user}\n")

    def test_unit_is_hardened(self):
        self.needs("systemd-analyze")

        def assess(unit):
            return run("systemd-analyze", "security", "--offline=true", f"--threshold={EXPOSURE}",
                       "--no-pager", unit)
        for name in self.UNITS:
            done = assess(self.unit(name=name))
            print("  " + done.stdout.strip().splitlines()[-1], file=sys.stderr)
            self.assertEqual(done.returncode, 0, done.stdout)
            softer = self.unit(lambda text: re.sub(r"(?m)^SystemCallFilter=[^~].*\n", "", text), name)
            self.assertNotEqual(assess(softer).returncode, 0)

    def test_time_to_stop_is_longer_than_that_of_open_connections(self):
        unit = self.unit(name="vantage-proxy").read_text()
        hard = re.search(r"^  hard-stop-after (\d+)s$",
                         (DEPLOY / "haproxy" / "haproxy.cfg").read_text(), re.MULTILINE)
        self.assertGreater(int(re.search(r"^TimeoutStopSec=(\d+)", unit, re.MULTILINE).group(1)),
                           int(hard.group(1)))

    def test_time_to_stop_is_longer_than_the_drain(self):
        unit = self.unit().read_text()
        config = (DEPLOY / "vantaged.toml").read_text()
        drain = int(re.search(r"^drain-seconds = (\d+)", config, re.MULTILINE).group(1))
        self.assertGreater(int(re.search(r"^TimeoutStopSec=(\d+)", unit, re.MULTILINE).group(1)),
                           drain)


if __name__ == "__main__":
    unittest.main()
