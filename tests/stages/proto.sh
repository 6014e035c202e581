#!/usr/bin/env bash
# buf lint, and buf breaking against the contract that was promised (proto/baseline). Buf comes
# from npm; where it cannot be had, contract.py looks for what breaks, and nothing is linted.
source "$(dirname "${BASH_SOURCE[0]}")/prelude.sh"
! command -v python3 >/dev/null || quietly contract-test python3 -B "$stages/contract_test.py"
"$stages/install.sh" proto || {
  if command -v protoc >/dev/null && command -v python3 >/dev/null; then
    echo "note: no buf, npm cannot be had or reached: not linted"
    exec python3 "$stages/contract.py"
  fi
  echo "skipped: no buf, npm cannot be had or reached, and no protoc or python3 in its place"
  exit "$skipped"
}
buf=$root/build/node/node_modules/.bin/buf
cd proto
"$buf" lint
"$buf" breaking --path vantage/v1 --path vantage/storage/v1 --against baseline/vantage.v1.binpb
