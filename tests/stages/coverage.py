#!/usr/bin/python3
"""Which files or test folders a stage of ./dev check covers, when it cannot cover all of them.

Usage: coverage.py --seconds N|--most N [--all] UNIT...
A unit is a source file or a folder of tests, without the folders in it. Prints those to cover, one on a line, and says on
standard error what it did and why. In this order, as long as they fit into N seconds of one
core, of compiling and running, or are N at most (of N as many percent as VANTAGE_SHARE says, where
time is short):

  1. units with changed files (a folder of tests also counts as changed with the folder that it
     tests)
  2. a quarter of all units in turn, by the number of commits (or VANTAGE_QUARTER, 1 to 4): four
     commits cover everything
  3. units that include what changed, by however many files in between, the nearest first

Changed is what differs from VANTAGE_CHANGED_SINCE, or else from 20 commits ago, and what is new.
The same tree, history and share always give the same answer: sources are counted at constant rates
for each kind, never timed.
"""

import argparse
import collections
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
COMMITS = 20
QUARTERS = 4
# Seconds of one core, under sanitizers: to compile a source, several at once, and to run what a
# source of tests has but for what long_tests.txt names.
LIBRARY, TEST, PROTO, RUN = 1.5, 5, 2, 10


def git(*args):
    return subprocess.run(["git", *args], cwd=ROOT, check=True, text=True,
                          stdout=subprocess.PIPE).stdout.splitlines()


def is_program(path):
    """Has its own main function, or is linked into a program of tests: nothing else needs it."""
    return path.endswith(("_test.cc", "_fuzzer.cc")) or path.startswith("tests/bench/")


class Sources:
    """Files of ours and what each of them includes."""

    def __init__(self):
        patterns = ("*.cc", "*.h", "*.proto")
        listed = git("ls-files", "--cached", "--others", "--exclude-standard", *patterns)
        self.files = sorted({file for file in listed if (ROOT / file).exists()})
        known = set(self.files)
        self.folders = collections.defaultdict(list)
        for file in self.files:
            self.folders[os.path.dirname(file)].append(file)
        self.includes = {}
        for file in self.files:
            text = (ROOT / file).read_text(errors="replace")
            named = re.findall(r'^\s*(?:#\s*include|import)\s+"([^"]+)"', text, re.MULTILINE)
            self.includes[file] = {found for name in named for found in self.places(file, name)
                                   if found in known}

    @staticmethod
    def places(file, name):
        """Where an include may lie: below the repository, beside the file, or generated."""
        proto = re.sub(r"(\.grpc)?\.pb\.h$", ".proto", name)
        return {name, os.path.normpath(os.path.join(os.path.dirname(file), name)),
                f"proto/{proto}", f"proto/third_party/{proto}"}

    def of(self, unit):
        if unit in self.includes:
            return [unit]
        return self.folders[unit]

    def closure(self, unit, linked):
        """What the unit includes, directly or not, and how many files lie in between; if linked,
        also the sources beside the headers."""
        found = {file: 0 for file in self.of(unit)}
        queue = collections.deque(found)
        while queue:
            file = queue.popleft()
            beside = {re.sub(r"\.h$", ".cc", file)} & self.includes.keys() if linked else set()
            for other in sorted(self.includes[file] | beside):
                if other not in found:
                    found[other] = found[file] + 1
                    queue.append(other)
        return found

    def compiled(self, unit):
        """Sources that are compiled for a unit: its own, and libraries as wholes."""
        own = self.of(unit)
        found, queue = set(own), collections.deque(own)
        while queue:
            for other in self.includes[queue.popleft()]:
                for file in {other, *self.folders[os.path.dirname(other)]}:
                    if file not in found and (file == other or not is_program(file)):
                        found.add(file)
                        queue.append(file)
        return {file for file in found if not file.endswith(".h")}


def changed_files():
    since = os.environ.get("VANTAGE_CHANGED_SINCE")
    if not since:
        since = git("rev-list", "--first-parent", "-n", str(COMMITS + 1), "HEAD")[-1]
    changed = git("diff", "--no-renames", "--name-only", since)
    return since, set(changed + git("ls-files", "--others", "--exclude-standard"))


def seconds(sources):
    def one(file):
        if is_program(file):
            return TEST + (RUN if file.endswith("_test.cc") else 0)
        return PROTO if file.endswith(".proto") else LIBRARY

    return sum(one(file) for file in sources)


def say(text):
    print(f"coverage: {text}", file=sys.stderr)


def choose(units, limit, counted=False):
    """The units to cover, in the order of importance."""
    sources = Sources()
    since, changed = changed_files()
    turn = int(os.environ.get("VANTAGE_QUARTER", 0)) - 1
    if turn < 0:
        turn = int(git("rev-list", "--count", "HEAD")[0]) % QUARTERS
    # Folders and files have quarters of their own.
    kinds = [[unit for unit in units if (unit in sources.includes) == kind] for kind in (0, 1)]
    turns = {unit: index * QUARTERS // len(kind) for kind in kinds
             for index, unit in enumerate(kind)}
    ranked = []
    for index, unit in enumerate(units):
        in_turn = turns[unit] == turn
        closure = sources.closure(unit, linked=not counted)
        tested = unit.removeprefix("tests/")
        distances = [hops for file, hops in closure.items() if file in changed]
        # In each group the dearest first: what is cheap finds a place beside it, not the other way
        # round.
        compiled = sources.compiled(unit)
        order = (not in_turn, 0 if counted else -seconds(compiled), index, unit, compiled)
        if any(file in changed for file in sources.of(unit)) or any(
                os.path.dirname(file) == tested for file in changed):
            ranked.append((0, 0, *order))
        elif in_turn:
            ranked.append((1, 0, *order))
        elif distances:
            ranked.append((2, min(distances), *order))
    ranked.sort()
    chosen, left_out, built, spent = [], 0, set(), 0
    for rank in ranked:
        compiled = rank[-1]
        cost = 1 if counted else seconds(compiled - built)
        if chosen and spent + cost > limit:
            left_out += 1
            continue
        chosen.append(rank)
        built |= compiled
        spent += cost
    counts = [sum(rank[0] == kind for rank in chosen) for kind in range(3)]
    say(f"{len(chosen)} of {len(units)}: {counts[0]} changed since {since[:12]}, {counts[1]} of "
        f"quarter {turn + 1} of {QUARTERS}, {counts[2]} that depend on what changed; "
        + (f"{limit} at most" if counted else f"about {spent:.0f} of {limit} s of one core"))
    names = [rank[-2] for rank in chosen]
    say("covered: " + brief(names))
    say("not covered: " + brief([unit for unit in units if unit not in names]))
    if left_out:
        say(f"{left_out} that changed, or depend on it, or are in turn, did not fit: "
            "./dev check --all covers everything")
    return names


def brief(names):
    """Names, or counts by folder when there are many."""
    if len(names) <= 24:
        return " ".join(names) or "nothing"
    folders = collections.Counter(os.path.dirname(name) for name in names)
    return ", ".join(f"{count} of {folder}" for folder, count in sorted(folders.items()))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    limit = parser.add_mutually_exclusive_group(required=True)
    limit.add_argument("--seconds", type=int)
    limit.add_argument("--most", type=int)
    parser.add_argument("--all", action="store_true")
    parser.add_argument("units", nargs="+")
    args = parser.parse_args()
    if args.all:
        say(f"all {len(args.units)}")
        print("\n".join(args.units))
    else:
        share = int(os.environ.get("VANTAGE_SHARE", 100))
        if share < 100:
            say(f"{share} % of what is usual: time is short")
        print("\n".join(choose(args.units, (args.seconds or args.most) * share // 100,
                               counted=args.seconds is None)))


if __name__ == "__main__":
    main()
