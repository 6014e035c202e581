#!/usr/bin/env bash
# containers.sh [TESTS]: makes the image, starts containers from it and drives them from outside.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
"$stages/install.sh" containers
"$stages/package.sh"
exec /usr/bin/python3 tests/containers/containers_test.py -v "$@"
