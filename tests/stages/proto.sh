#!/usr/bin/env bash
# buf lint, and buf breaking against the contract that was published (proto/baseline). Buf comes
# from npm; where it cannot be had, the stage is skipped.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
"$stages/install.sh" proto || {
  echo "skipped: no buf, npm cannot be had or reached"
  exit "$skipped"
}
buf=$root/build/node/node_modules/.bin/buf
cd proto
"$buf" lint
"$buf" breaking --path vantage/v1 --path vantage/storage/v1 --against baseline/vantage.v1.binpb
