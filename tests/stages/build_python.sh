#!/usr/bin/env bash
# build_python.sh: the wheel of client/python, into build/python. Nothing comes from a registry.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
"$stages/install.sh" python
to=$root/build/python
rm -rf "$to"
mkdir -p "$to/source"
cp -r client/python/pyproject.toml client/python/README.md client/python/vantage LICENSE "$to/source"
find "$to/source" -name __pycache__ -prune -exec rm -rf {} +
quietly python-stubs /usr/bin/python3 -B client/python/stubs.py proto "$to/source"
# The same sources give the same wheel.
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct 2>/dev/null || echo 315532800)
export SOURCE_DATE_EPOCH
quietly python-wheel /usr/bin/python3 -m pip wheel --no-index --no-build-isolation --no-deps \
  --no-cache-dir -w "$to" "$to/source"
say "done: $(echo "$to"/*.whl)"
