#!/usr/bin/env python3
"""Whether the house stands as CONTRIBUTING.md draws it: no type is defined twice in a namespace
(the linker would take either), files stand in the namespace of their folder, includes between rooms
go the way that 'Who may include whom' draws, and nowhere in a circle; and whether what comments and
pages cite is there (citations.py). Lines are read as clang-format leaves them."""
import collections
import os
import re
import subprocess
import sys

import citations

# What no file of a part includes.
FORBIDDEN = {'core': ('server/', 'client/', 'tests/', 'grpc', 'google/', 'vantage/'),
             'server': ('client/', 'tests/', 'core/simulation/'),
             'client': ('server/', 'tests/')}
NAMESPACES = {'server/main': 'server', 'client/library': 'client', 'tests/support': 'test_support'}


def module(path):
    """The folder that names a file's namespace: core/planning for core/planning/plan/plan.h."""
    names = path.split('/')[:-1]
    if names[0] == 'tests' and names[1] in ('core', 'server', 'client'):
        names = names[1:]
    return '/'.join(names[:2])


def types(path, text):
    """Namespace and name of each class, struct and enum that is defined outside of others."""
    space = []
    for line in text.split('\n'):
        if match := re.match(r'(?:inline )?namespace ([\w:]+)', line):
            space.append(match[1])
        elif line.startswith('namespace {'):
            space.append('')
        elif line.startswith('}  // namespace'):
            space.pop()
        elif match := re.match(r'(?:class|struct|enum class|enum|union) (?:\w+\(.*?\) )?'
                               r'(\w+)(?!\w|::)[^;]*$', line):
            specialised = '<' in line.split(match[1], 1)[1].split('{')[0].split(':')[0]
            if '' not in space and not specialised:
                yield '::'.join(space), match[1]


def drawn():
    """What CONTRIBUTING.md draws: which rooms of a folder each room in it may include."""
    with open('CONTRIBUTING.md', encoding='utf-8') as file:
        drawing = re.search(r'^Who may include whom.*?\n\n(.*?)\n\n', file.read(), re.M | re.S)[1]
    orders, folder = {}, None
    for line in drawing.split('\n'):
        name, order = re.match(r' {4}([\w/]*) +(\w+(?:(?:,| <) \w+)*)', line).groups()
        folder = name or folder
        may = orders.setdefault(folder, {})
        before = set()
        for step in order.split(' < '):
            rooms = step.split(', ')
            for room in rooms:
                may.setdefault(room, set()).update(before)
            before = before.union(rooms, *(may[room] for room in rooms))
    return orders


def against(orders, path, to):
    """Whether an include goes another way than is drawn. What lies in a folder itself uses all
    rooms of the folder, and none of them uses it."""
    here, there = path.split('/')[:-1], to.split('/')[:-1]
    depth = len(os.path.commonprefix([here, there]))
    may = orders.get('/'.join(here[:depth]) + '/')
    if may is None or depth == len(here):
        return False
    return depth == len(there) or there[depth] not in may.get(here[depth], ())


def circles(arrows):
    """Groups of nodes that reach each other (Tarjan 1972)."""
    index, low, stack, found = {}, {}, [], []

    def visit(node):
        index[node] = low[node] = len(index)
        stack.append(node)
        for to in arrows.get(node, ()):
            if to not in index:
                visit(to)
            if to in stack:
                low[node] = min(low[node], low[to])
        if low[node] == index[node]:
            group = stack[stack.index(node):]
            del stack[-len(group):]
            if len(group) > 1:
                found.append(sorted(group))

    for node in sorted(arrows):
        if node not in index:
            visit(node)
    return found


def main():
    sys.setrecursionlimit(10000)
    os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), '../..'))
    listed = subprocess.run(['git', 'ls-files', '-co', '--exclude-standard'], capture_output=True,
                            text=True, check=True)
    everything = [p for p in listed.stdout.split() if os.path.exists(p)]
    paths = [p for p in everything if p.endswith(('.h', '.cc')) and
             p.startswith(('core/', 'server/', 'client/', 'tests/'))]
    wrong = citations.wrong([p for p in everything if '/data/' not in p])
    defined = collections.defaultdict(set)
    rooms, units = collections.defaultdict(set), collections.defaultdict(set)
    orders = drawn()
    for path in paths:
        with open(path, encoding='utf-8') as file:
            text = file.read()
        for space, name in types(path, text):
            defined[f'{space}::{name}'].add(path)
        home = NAMESPACES.get(module(path), module(path).split('/')[-1])
        for space in re.findall(r'^namespace (vantage[\w:]*) \{', text, re.M):
            if space.split('::')[1:2] != [home]:
                wrong.append(f'{path}: namespace {space}, in a folder of vantage::{home}')
        part = path.split('/')[0]
        for to in re.findall(r'^#include ["<]([^">]+)[">]', text, re.M):
            if to.startswith(FORBIDDEN.get(part, ())) or against(orders, path, to):
                wrong.append(f'{path}: includes {to}')
            if part == 'tests' or not to.startswith(('core/', 'server/', 'client/')):
                continue
            here, there = os.path.dirname(path), os.path.dirname(to)
            if here != there:
                rooms[here].add(there)
            if path.rsplit('.', 1)[0] != to.rsplit('.', 1)[0]:
                units[path.rsplit('.', 1)[0]].add(to.rsplit('.', 1)[0])
    wrong += [f'{name} is defined in {" and ".join(sorted(where))}'
              for name, where in defined.items() if len(where) > 1 and name.count('::') > 1]
    wrong += [f'a circle of rooms: {" ".join(group)}' for group in circles(rooms)]
    wrong += [f'a circle of files: {" ".join(group)}' for group in circles(units)]
    print('\n'.join(wrong) or
          f'{len(paths)} files, {len(defined)} types, all includes as drawn, no circle, all that '
          'is cited is there')
    return bool(wrong)


if __name__ == '__main__':
    sys.exit(main())
