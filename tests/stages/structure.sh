#!/usr/bin/env bash
# No type defined twice, namespaces by folder, includes one way, citations that lead somewhere.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
exec /usr/bin/python3 -B tests/stages/structure.py
