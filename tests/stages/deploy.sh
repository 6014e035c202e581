#!/usr/bin/env bash
# Kubernetes, Compose, HAProxy and systemd as they are delivered.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
"$stages/install.sh" build deploy
"$stages/build.sh" release vantaged
VANTAGE_NODE=build/node-deploy exec /usr/bin/python3 tests/deploy/deploy_test.py -v
