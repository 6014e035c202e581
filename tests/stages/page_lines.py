#!/usr/bin/env python3
"""page_lines.py [--methods RULES] PAGE...: runs the commands of the pages, in order, in one shell and
one folder, and checks that each ends as its page says.

Commands are indented lines that begin with '$', and the lines of fenced blocks marked 'sh' (one that
ends with a backslash goes on, and what a command reads from there is its own). '    # not_found' behind a command is the gRPC error that it ends with,
'    # exits 7' its status; without either it has to succeed. What ends with '&' begins a server; a
server listens where its page says, or where all commands look without being told. Every method of
RULES has to be on a page. The commands see the contract as they do in a checkout."""

import argparse
import os
import pathlib
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time

CONTRACT = pathlib.Path(__file__).resolve().parent.parent.parent / "proto"
ADDRESS = re.compile(r"(127\.0\.0\.1|localhost):(\d+)")
PATIENCE = 120  # s, for a command
USUAL = "127.0.0.1:7464"  # where the server is, and clients look


def expectation(command):
    """(command, error that it ends with or None, status or None)."""
    found = re.fullmatch(r"(.*?) {4}# (?:exits (\d+)|([a-z_]+))", command, re.S)
    if found is None:
        return command, None, None
    return found[1], found[3], None if found[2] is None else int(found[2])


def commands_of(page):
    """Each command of a page as it stands there."""
    fenced, begun, ends = False, "", None
    for line in page.splitlines():
        if ends is not None:  # within what a command reads from the page
            begun += f"{line}\n"
            if line == ends:
                yield begun
                begun, ends = "", None
            continue
        if line.startswith("```"):
            fenced = line == "```sh" if not fenced else False
            continue
        if not fenced:
            dollar = re.fullmatch(r" {4}\$ (.*)", line)
            if dollar:
                yield dollar[1]
            continue
        begun += line
        here = re.search(r"<<'(\w+)'$", line)
        if here:
            begun, ends = begun + "\n", here[1]
        elif line.endswith("\\"):
            begun += "\n"
        elif begun.strip() and not begun.startswith("#"):
            yield begun
            begun = ""
        else:
            begun = ""


class Ports:
    """Free ports in place of those on the pages."""

    def __init__(self):
        self.free = {}

    def replaced(self, command):
        return ADDRESS.sub(lambda found: f"{found[1]}:{self.of(found[2])}", command)

    def of(self, port):
        if port not in self.free:
            with socket.socket() as one:
                one.bind(("127.0.0.1", 0))
                self.free[port] = str(one.getsockname()[1])
        return self.free[port]


class Shell:
    """A bash that keeps its functions and servers from one command to the next."""

    def __init__(self, folder, environment):
        self.process = subprocess.Popen(["bash"], cwd=folder, env=environment, text=True,
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        stderr=subprocess.STDOUT)

    def run(self, command):
        """(status, what it said)."""
        self.process.stdin.write(f"{command}\nstatus=$?; echo; echo status-of-it $status\n")
        self.process.stdin.flush()
        said = []
        # What hangs ends with the shell.
        patience = threading.Timer(PATIENCE, self.process.kill)
        patience.start()
        try:
            for line in self.process.stdout:
                if line.startswith("status-of-it "):
                    return int(line.split()[1]), "".join(said)
                said.append(line)
        finally:
            patience.cancel()
        raise RuntimeError(f"the shell ended with:\n{command}\n" + "".join(said))

    def end(self):
        self.process.stdin.write("kill $(jobs -p); wait\n")
        self.process.stdin.close()
        self.process.wait(60)


def serves(address):
    host, port = address.rsplit(":", 1)
    try:
        socket.create_connection((host, int(port)), 1).close()
        return True
    except OSError:
        return False


def begin_server(shell, command, ports):
    """Starts what ends with '&', and waits for its ports."""
    begun = command.rstrip().removesuffix("&")
    if re.match(r"vantaged\b", begun) and "--listen" not in begun and "--config" not in begun:
        begun += f" --listen {ports.replaced(USUAL)}"
    shell.run(f"{begun} >>log 2>&1 &")
    listens = re.findall(r"--(?:listen|web|http) ((?:127\.0\.0\.1|localhost):\d+)", begun)
    until = time.monotonic() + 60
    while not all(map(serves, listens)) and time.monotonic() < until:
        time.sleep(0.1)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--methods")
    parser.add_argument("pages", nargs="+")
    arguments = parser.parse_args()
    texts = [pathlib.Path(page).read_text() for page in arguments.pages]
    methods = []
    if arguments.methods:
        rules = pathlib.Path(arguments.methods).read_text()
        methods = re.findall(r'\{"(\w+)", "(\w+)",', rules)
        missing = [f"{service}/{method}" for service, method in methods
                   if not any(f"{service}/{method} " in text for text in texts)
                   and method not in ("UploadScan",)]
        if missing:
            sys.exit(f"the page lacks {', '.join(missing)}")
    ports, failed, ran = Ports(), 0, 0
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "proto").symlink_to(CONTRACT)
        environment = {name: value for name, value in os.environ.items()
                       if not name.startswith(("VANTAGE_", "XDG_"))}
        environment |= {"HOME": folder, "VANTAGE_SERVER": ports.replaced(USUAL)}
        shell = Shell(folder, environment)
        try:
            for command in (one for text in texts for one in commands_of(text)):
                started = time.monotonic()
                command, error, status = expectation(ports.replaced(command))
                if command.rstrip().endswith("&"):
                    begin_server(shell, command, ports)
                    continue
                ended, said = shell.run(command)
                ran += 1
                if error is not None:
                    well = re.search(rf'"code": ?"{error}"', said) is not None
                else:
                    well = ended == (status or 0)
                if not well:
                    failed += 1
                    print(f"{command}\nended with {ended}, expected "
                          f"{error or status or 'success'}:\n{said}")
                elif os.environ.get("VANTAGE_SHOW"):
                    print(f"[{time.monotonic() - started:5.1f} s] {command}\n{said}")
        finally:
            shell.end()
    print(f"{ran} lines, {len(methods)} methods, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
