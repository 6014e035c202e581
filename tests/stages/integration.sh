#!/usr/bin/env bash
# Whole jobs through a server of build/release, but for what seeds.sh runs.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
exec "$stages/unit.sh" --test-dir "build/${VANTAGE_PRESET:-release}" -L integration -E "$further_seeds"
