"""The -dev packages on a bare Debian with a compiler: the examples are built and run there, against
what is installed alone."""

import pathlib
import re
import time

import room_scan
from engine import FOLDER, ROOT, Container
from harness import PACKAGES, ContainerTest, house, open_house, say

# What the packages demand of whoever includes their headers, beside the standard library.
ALLOWED = r"absl/|Eigen/|google/protobuf/|grpcpp/|sys/types\.h|unistd\.h"


def setUpModule():
    open_house()


def public_headers():
    """What a program is meant to include, as it is installed."""
    for page in ("core/installed/CMakeLists.txt", "client/library/CMakeLists.txt"):
        listed, = re.findall(r"HEADERS(.*?)(?:LINK|\$)", (ROOT / page).read_text(), re.DOTALL)
        yield from (f"vantage/{header}" for header in listed.split())


class LibraryTest(ContainerTest):
    def container(self, target=None):
        """With the examples, a scan and a folder to build in."""
        options = () if target is None else ("--target", target)
        began = time.monotonic()
        image = house.engine.build(f"development-{target or 'all'}", FOLDER / "development.Dockerfile",
                                   PACKAGES, options=options, BASE=house.base)
        say(f"a Debian with the packages made in {time.monotonic() - began:.0f} s")
        container = Container(house.engine, image, "sleep", "3600")
        self.addCleanup(container.remove)
        folder = pathlib.Path(house.engine.scratch())
        (folder / "room.ptx").write_text(room_scan.ptx(room_scan.FIRST))
        house.engine.run("cp", ROOT / "client" / "examples", f"{container.name}:/examples")
        house.engine.run("cp", folder / "room.ptx", f"{container.name}:/room.ptx")
        return container

    def shell(self, container, script, **how):
        return container.execute("sh", "-ec", script, **how)

    def test_plans_without_grpc(self):
        container = self.container("core")
        installed = self.shell(container, "dpkg-query -W -f '${Package}\n'")
        for unwanted in ("grpc", "protobuf", "vtk", "libpcl-dev"):
            self.assertNotIn(unwanted, installed)
        self.shell(container, "cmake -S /examples -B /b -G Ninja -DCMAKE_BUILD_TYPE=Release "
                              "-DCMAKE_CXX_FLAGS='-Wall -Wextra -Werror' && ninja -C /b")
        self.assertEqual(self.shell(container, "ls /b/upload_and_watch 2>/dev/null || echo none"),
                         "none", "no component client, no program of it")
        plan = self.shell(container, "/b/plan_ptx /room.ptx")
        say(f"plan_ptx: {plan.splitlines()[0]}")
        self.assertRegex(plan, r"^\d+ views\. .*register")
        self.assertRegex(plan, r"\(-?\d+\.\d\d, -?\d+\.\d\d, -?\d+\.\d\d\) m: \d+\.\d m\^2, ")
        self.assertRegex(self.shell(container, "/b/plan_ptx /none.ptx 2>&1 || echo $?"),
                         "(?s)NOT_FOUND.*1$")
        # A program that Eigen would lay out otherwise in: with AVX the types are those of the library.
        self.shell(container, "cmake -S /examples -B /avx -G Ninja -DCMAKE_CXX_FLAGS=-mavx2 && "
                              "ninja -C /avx plan_ptx")
        if "avx2" in pathlib.Path("/proc/cpuinfo").read_text():
            self.assertEqual(self.shell(container, "/avx/plan_ptx /room.ptx").splitlines()[0],
                             plan.splitlines()[0])
        # Another minor version may have other headers.
        for wanted, found in (("0.1", True), ("0.2", False), ("0.0", False)):
            script = ("printf 'cmake_minimum_required(VERSION 3.25)\nproject(p CXX)\n"
                      f"find_package(vantage {wanted} CONFIG REQUIRED COMPONENTS core)\n' "
                      ">/v/CMakeLists.txt; cmake -S /v -B /v/b -G Ninja >/v/log 2>&1 && echo found || "
                      "grep -o 'compatible with requested' /v/log")
            self.assertEqual("found" in self.shell(container, "rm -rf /v; mkdir -p /v; " + script), found,
                             wanted)

    def test_uploads_and_watches(self):
        container = self.container()
        self.shell(container, "cmake -S /examples -B /b -G Ninja && ninja -C /b upload_and_watch; "
                              "vantaged --in-memory --listen unix:/v.sock >/log 2>&1 & "
                              "for i in $(seq 100); do test -S /v.sock && exit 0; sleep 0.1; done; "
                              "cat /log; exit 1")
        said = self.shell(container, "until [ -x /b/upload_and_watch ]; do sleep 0.2; done; "
                                     "/b/upload_and_watch unix:/v.sock flat /room.ptx")
        self.assertIn("96816 of 96816 bytes\n", said)
        self.assertRegex(said, r"revision \d+: [1-9]\d* views")
        self.assertIn("m from scan-1 at a bearing of", said)
        self.check_headers(container)
        self.check_python(container)

    def check_python(self, container):
        """vantage_core of the package, with Debian's Python."""
        said = self.shell(container, """python3 -c '
import numpy as np, vantage_core as core
image, scanner, pose = core.read("/room.ptx")
model = core.Model()
model.insert("first", image, scanner, core.level(image, scanner))
config = core.PlanningConfig()
config.required_density = 100
plan = model.plan(scanner, config, work_limit_rays=2000000)
print(len(plan.views), core.__version__)'""")
        self.assertRegex(said, r"^[1-9]\d* \d+\.\d+\.\d+$")

    def check_headers(self, container):
        """Each that is public compiles alone, all of them together, and none names another's."""
        headers = self.shell(container, "cd /usr/include && find vantage -name '*.h' | sort -r").split()
        public = set(public_headers())
        self.assertGreater(len(public), 20)
        self.assertLessEqual(public, set(headers))
        found = self.shell(container, "cd /usr/include && grep -rEh '^#include' vantage")
        for name in sorted(set(re.findall(r'#include ["<]([^">]+)[">]', found))):
            if not name.startswith("vantage/") and "/" in name or name.endswith(".h"):
                self.assertTrue(name in headers or re.match(ALLOWED, name), name)
        sources = {f"alone_{i}.cc": [name] for i, name in enumerate(sorted(public))}
        sources["together.cc"] = headers
        folder = pathlib.Path(house.engine.scratch())
        for name, included in sources.items():
            (folder / name).write_text("".join(f"#include <{header}>\n" for header in included))
        (folder / "CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.25)\nproject(headers CXX)\n"
            "find_package(vantage CONFIG REQUIRED COMPONENTS core client)\n"
            f"add_library(headers OBJECT {' '.join(sources)})\n"
            "target_compile_options(headers PRIVATE -fsyntax-only)\n"
            "target_link_libraries(headers PRIVATE vantage::client)\n")
        house.engine.run("cp", f"{folder}/.", f"{container.name}:/headers")
        self.shell(container, "cmake -S /headers -B /h -G Ninja && ninja -C /h -k 0")
        say(f"{len(public)} public headers compile alone, {len(headers)} together")
