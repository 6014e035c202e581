#!/usr/bin/env bash
# The seeds and scenes that ./dev test leaves out.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
"$stages/install.sh" test
"$stages/build.sh" release vantage_tests
exec "$stages/unit.sh" --test-dir build/release -R "$further_seeds"
