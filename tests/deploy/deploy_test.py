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
import shutil
import subprocess
import sys
import tempfile
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


class KubernetesTest(DeployTest):
    GROUPS = {"v1": "core/v1", "apps/v1": "apps/v1", "networking.k8s.io/v1": "networking/v1",
              "policy/v1": "policy/v1"}

    def documents(self):
        """Those of the base, one by one as they stand, and what kustomize makes of each folder."""
        base = DEPLOY / "kubernetes" / "base"
        listed = yaml.safe_load((base / "kustomization.yaml").read_text())["resources"]
        self.assertEqual(sorted(listed), sorted(path.name for path in base.glob("*.yaml")
                                                if path.name != "kustomization.yaml"))
        found = {"files": [document for name in listed
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
                                  for part in documents})

    def check_names(self, parts):
        pods = parts["StatefulSet", "vantage"]["spec"]
        template = pods["template"]
        labels = template["metadata"]["labels"]
        spec = template["spec"]
        container, = spec["containers"]
        ports = {port["name"]: port["containerPort"] for port in container["ports"]}
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
        for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
            asks = container[probe]
            self.assertEqual(len(asks.keys() & {"grpc", "httpGet"}), 1, probe)
            if "grpc" in asks:
                self.assertIn(asks["grpc"]["port"], ports.values())
            else:
                self.assertIn(asks["httpGet"]["port"], ports)
        self.assertEqual({claim["metadata"]["name"] for claim in pods["volumeClaimTemplates"]}
                         | {volume["name"] for volume in spec["volumes"]},
                         {mount["name"] for mount in container["volumeMounts"]})
        self.assertTrue(container["securityContext"]["readOnlyRootFilesystem"])
        self.assertTrue(spec["securityContext"]["runAsNonRoot"])
        self.assertIn("memory", container["resources"]["requests"])
        # What the server reads lies below what is mounted, and its options are known.
        config = parts["ConfigMap", "vantage"]["data"]["vantaged.toml"]
        keys = toml_keys(config)
        self.assertKnown(keys)
        mounts = [mount["mountPath"] for mount in container["volumeMounts"]]
        for path in re.findall(r'"(/[^"]+)"', config):
            self.assertTrue(any(path.startswith(mount + "/") for mount in mounts), path)
        for port in re.findall(r'"0\.0\.0\.0:(\d+)"', config):
            self.assertIn(int(port), ports.values())
        drain = int(re.search(r"^drain-seconds = (\d+)", config, re.MULTILINE).group(1))
        self.assertGreater(spec["terminationGracePeriodSeconds"], drain)
        # Other machines are served with encryption, or where it is said that others encrypt.
        self.assertEqual("tls-cert" in keys, "allow-insecure-remote" not in keys)
        self.assertIn("callers", keys)


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
        proxy = (self.FOLDER / "haproxy.cfg").read_text()
        for key in ("listen", "http"):
            port = given[key].split(":")[1]
            self.assertIn(f"-vantaged:{port}" if key == "listen" else f"-{port}}}", proxy)
        self.assertTrue(described["networks"]["inside"]["internal"])
        self.assertEqual(services["vantaged"]["networks"], ["inside"])
        self.assertNotIn("ports", services["vantaged"])
        self.assertEqual(given["callers"], "/run/vantage/access/callers")
        for service in services.values():
            for volume in service["volumes"]:
                source = volume.split(":")[0]
                if source.startswith("./"):
                    # Made by the operator, or delivered.
                    self.assertTrue(source in ("./access", "./certs")
                                    or (self.FOLDER / source).is_file(), source)
                else:
                    self.assertIn(source, described["volumes"])
        targets = {target for job in yaml.safe_load(
            (self.FOLDER / "prometheus.yml").read_text())["scrape_configs"]
            for config in job["static_configs"] for target in config["targets"]}
        self.assertEqual(targets, {f"vantaged:{given['http'].split(':')[1]}", "haproxy:8404"})

    def test_haproxy_takes_it(self):
        self.needs("haproxy")
        self.needs("openssl")
        folder = self.scratch()
        done = run("openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt",
                   "ec_paramgen_curve:P-256", "-nodes", "-days", "1", "-subj", "/CN=localhost",
                   "-keyout", folder / "key", "-out", folder / "cert")
        self.assertEqual(done.returncode, 0, done.stdout)
        (folder / "server.pem").write_text((folder / "cert").read_text()
                                           + (folder / "key").read_text())
        environment = {"PATH": PATH, "VANTAGE_CERTS": str(folder)}
        text = (self.FOLDER / "haproxy.cfg").read_text()
        for given, takes in (
                (text, True), (text.replace("timeout connect", "timeout conect"), False),
                (text.replace("default_backend vantaged", "default_backend v"), False)):
            (folder / "haproxy.cfg").write_text(given)
            done = run("haproxy", "-c", "-f", folder / "haproxy.cfg", env=environment)
            self.assertEqual(done.returncode == 0, takes, done.stdout)


class SystemdTest(DeployTest):
    def unit(self, change=lambda text: text):
        """The unit as a file, with the server where it is built."""
        text = (DEPLOY / "systemd" / "vantaged.service").read_text()
        file = self.scratch() / "vantaged.service"
        file.write_text(change(text.replace("/usr/bin/vantaged", str(BUILD / "server/vantaged"))))
        return file

    def test_unit_is_understood(self):
        self.needs("systemd-analyze")
        done = run("systemd-analyze", "verify", "--man=no", self.unit())
        self.assertEqual((done.returncode, done.stdout), (0, ""))
        wrong = self.unit(lambda text: text.replace("StateDirectory=", "StateFolder="))
        self.assertNotEqual(run("systemd-analyze", "verify", "--man=no", wrong).stdout, "")

    def test_unit_is_hardened(self):
        self.needs("systemd-analyze")

        def assess(unit):
            return run("systemd-analyze", "security", "--offline=true", f"--threshold={EXPOSURE}",
                       "--no-pager", unit)
        done = assess(self.unit())
        print("  " + done.stdout.strip().splitlines()[-1], file=sys.stderr)
        self.assertEqual(done.returncode, 0, done.stdout)
        softer = self.unit(lambda text: text.replace("SystemCallFilter=@system-service\n", ""))
        self.assertNotEqual(assess(softer).returncode, 0)

    def test_time_to_stop_is_longer_than_the_drain(self):
        unit = self.unit().read_text()
        config = (DEPLOY / "vantaged.toml").read_text()
        drain = int(re.search(r"^drain-seconds = (\d+)", config, re.MULTILINE).group(1))
        self.assertGreater(int(re.search(r"^TimeoutStopSec=(\d+)", unit, re.MULTILINE).group(1)),
                           drain)


if __name__ == "__main__":
    unittest.main()
