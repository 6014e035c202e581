#!/usr/bin/env bash
# build_web.sh: the page, from client/web and the contract, into build/web.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
"$stages/install.sh" page
cd client/web
quietly web-generate npm run generate
quietly web-build npm run build
say "done: build/web"
