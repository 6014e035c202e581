#!/usr/bin/env python3
"""calls.py PAGE RULES: runs the lines of the page that begin with '$', in order, in one shell, and
checks that each ends as the page says: well, or with the error that stands behind '#'. Every method
of RULES must be on the page. The page's lines see the contract as they do in a checkout."""

import pathlib
import re
import socket
import subprocess
import sys
import tempfile
import time

PORTS = ("7464", "7466")  # on the page
CONTRACT = pathlib.Path(__file__).resolve().parent.parent.parent / "proto"


def lines_of(page):
    """(command, error it ends with or None)."""
    for line in page.splitlines():
        found = re.fullmatch(r" {4}\$ (.*?)(?: {4}# ([a-z_]+))?", line)
        if found:
            yield found.group(1), found.group(2)


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return str(one.getsockname()[1])


class Shell:
    """A bash that keeps its functions from one command to the next."""

    def __init__(self, folder):
        self.process = subprocess.Popen(["bash"], cwd=folder, text=True, stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def run(self, command):
        """(status, what it said)."""
        self.process.stdin.write(f"{command}\nstatus=$?; echo; echo status-of-it $status\n")
        self.process.stdin.flush()
        said = []
        for line in self.process.stdout:
            if line.startswith("status-of-it "):
                return int(line.split()[1]), "".join(said)
            said.append(line)
        raise RuntimeError("the shell ended:\n" + "".join(said))

    def end(self):
        self.process.stdin.write("kill %1; wait\n")
        self.process.stdin.close()
        self.process.wait(60)


def serves(port):
    try:
        socket.create_connection(("127.0.0.1", int(port)), 1).close()
        return True
    except OSError:
        return False


def main():
    page, rules = (pathlib.Path(name).read_text() for name in sys.argv[1:])
    methods = re.findall(r'\{"(\w+)", "(\w+)",', rules)
    missing = [f"{service}/{method}" for service, method in methods
               if f"{service}/{method} " not in page and method not in ("UploadScan",)]
    if missing:
        sys.exit(f"the page lacks {', '.join(missing)}")
    ports, failed, ran = {port: free_port() for port in PORTS}, 0, 0
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "proto").symlink_to(CONTRACT)
        shell = Shell(folder)
        try:
            for command, error in lines_of(page):
                for port, free in ports.items():
                    command = command.replace(f"127.0.0.1:{port}", f"127.0.0.1:{free}")
                if command.startswith("vantaged "):
                    shell.run(command.removesuffix("&") + ">log 2>&1 &")
                    until = time.monotonic() + 60
                    while not all(map(serves, ports.values())) and time.monotonic() < until:
                        time.sleep(0.1)
                    continue
                status, said = shell.run(command)
                ran += 1
                well = status == 0 if error is None else re.search(
                    rf'"code": ?"{error}"', said) is not None
                if not well:
                    failed += 1
                    print(f"{command}\nended with {status}, expected {error or 'success'}:\n{said}")
        finally:
            shell.end()
    print(f"{ran} lines, {len(methods)} methods, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
