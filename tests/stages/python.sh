#!/usr/bin/env bash
# python.sh [TESTS]: the wheel of client/python and vantage_core, as they are installed, against a server.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
"$stages/build_python.sh"
"$stages/install.sh" build
"$stages/build.sh" release vantaged vantage_core_python
venv=$root/build/python/venv
quietly python-venv /usr/bin/python3 -m venv --system-site-packages "$venv"
quietly python-install "$venv/bin/pip" install --no-index --no-deps "$root"/build/python/vantage-*.whl
(cd build/python/source && /usr/bin/python3 -m mypy --cache-dir ../mypy -p vantage)
(($#)) || set -- discover -v -s "$root/tests/client/python" -p '*_test.py'
cd "$root/build/python"
# What hangs says where, before the stage's limit ends it. Lost links come back without gRPC's own look
# after them, every 5 s.
VANTAGE_SERVER_BINARY=$root/build/release/server/vantaged MPLBACKEND=Agg \
  GRPC_CLIENT_CHANNEL_BACKUP_POLL_INTERVAL_MS=0 \
  PYTHONPATH=$root/build/release/client/python:$root/client/python/examples:$root/tests/client/python \
  exec timeout -s ABRT 450 "$venv/bin/python" -X faulthandler -B -W error::DeprecationWarning:vantage -m unittest "$@"
