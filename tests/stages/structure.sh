#!/usr/bin/env bash
# No type defined twice, namespaces by folder, includes that go one way.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
exec /usr/bin/python3 -B tests/stages/structure.py
