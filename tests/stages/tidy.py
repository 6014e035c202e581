#!/usr/bin/python3
"""clang-tidy over the files that standard input names, with build/tidy/compile_commands.json.

Most of its time goes into headers, so up to eight files of a folder are read as one piece; if there
is anything to say about a piece, or it does not compile as one, the files that this names are read
by themselves, and only that counts. What was found clean is remembered: by the files, all that they
include of ours, the options, and the versions of what they are compiled with.
"""

import collections
import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys

import coverage

ROOT = coverage.ROOT
TREE = ROOT / "build" / "tidy"
GENERATED = ROOT / "build" / "release" / "proto" / "gen"
CACHE = pathlib.Path(os.environ.get("XDG_CACHE_HOME", pathlib.Path.home() / ".cache"),
                     "vantage", "tidy")
PIECE = 8


def output(*command):
    return subprocess.run(command, cwd=ROOT, text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.DEVNULL, check=False).stdout


def commands():
    """The options of each file that is compiled."""
    found = {}
    for entry in json.loads((TREE / "compile_commands.json").read_text()):
        file = os.path.relpath(entry["file"], ROOT)
        options = shlex.split(entry["command"])
        options = options[next(i for i, o in enumerate(options) if "clang++" in o) + 1:]
        for flag in ("-o", "-c"):  # each has a value
            at = options.index(flag)
            del options[at:at + 2]
        found.setdefault(file, options + [f"-isystem{GENERATED}"])
    return found


class Tidy:
    def __init__(self):
        self.sources = coverage.Sources()
        self.options = commands()
        self.versions = (
            output("clang-tidy-14", "--version") + (ROOT / ".clang-tidy").read_text() +
            output("dpkg-query", "-W", "libgrpc++-dev", "libabsl-dev", "libstdc++-12-dev",
                   "libpcl-common1.13"))
        self.texts = {}

    def text(self, file):
        if file not in self.texts:
            self.texts[file] = (ROOT / file).read_bytes()
        return self.texts[file]

    def key(self, file):
        digest = hashlib.sha256(repr((file, self.options[file], self.versions)).encode())
        for other in sorted(self.sources.closure(file, linked=False)):
            digest.update(other.encode() + b"\0" + self.text(other))
        return CACHE / digest.hexdigest()

    def read(self, file, options):
        done = subprocess.run(
            ["clang-tidy-14", "--quiet", r"--header-filter=/(core|server|client|tests)/.*\.(h|cc)$",
             str(file), "--", *options],
            cwd=ROOT, text=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=False)
        return done.returncode == 0 and "warning:" not in done.stdout, done.stdout

    def check(self, files):
        """Those of a piece that are not clean, with what there is to say."""
        alone, together = [], list(files)
        while len(together) > 1:
            piece = TREE / "pieces" / together[0].replace("/", "_")
            piece.write_text("".join(f'#include "{ROOT / file}"\n' for file in together))
            clean, what = self.read(piece, self.options[together[0]])
            if clean:
                together = []
                break
            named = set(re.findall(
                rf"^{re.escape(str(ROOT))}/(\S+?):\d+:\d+: (?:error|warning)", what,
                re.MULTILINE))
            suspects = [file for file in together if file in named] or together
            alone += suspects
            together = [file for file in together if file not in suspects]
        found = []
        for file in alone + together:
            clean, what = self.read(ROOT / file, self.options[file])
            if not clean:
                found.append((file, what))
        return found


def main():
    tidy = Tidy()
    (TREE / "pieces").mkdir(parents=True, exist_ok=True)
    CACHE.mkdir(parents=True, exist_ok=True)
    named = [line.strip() for line in sys.stdin if line.strip()]
    files = [file for file in named if file in tidy.options]
    keys = {file: tidy.key(file) for file in files}
    groups = collections.defaultdict(list)
    for file in files:
        if not keys[file].exists():
            groups[os.path.dirname(file), repr(tidy.options[file])].append(file)
    pieces = [group[i:i + PIECE] for group in groups.values() for i in range(0, len(group), PIECE)]
    todo = sum(map(len, pieces))
    print(f"clang-tidy: {todo} files in {len(pieces)} pieces; {len(files) - todo} were clean "
          f"before, {len(named) - len(files)} are not compiled")
    dirty = 0
    jobs = int(os.environ.get("VANTAGE_JOBS", os.cpu_count()))
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for piece, found in zip(pieces, pool.map(tidy.check, pieces)):
            for file, what in found:
                print(f"{what}clang-tidy: {file}")
            bad = {file for file, _ in found}
            dirty += len(bad)
            for file in set(piece) - bad:
                keys[file].touch()
    sys.exit(1 if dirty else 0)


if __name__ == "__main__":
    main()
