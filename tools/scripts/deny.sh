#!/usr/bin/env bash
# Checks the dependencies by cargo-deny, as deny.toml says: licences, sources, versions that come twice,
# and known vulnerabilities.
#
# usage: deny.sh
# environment: INSTALL_LIMIT (seconds for building cargo-deny, 900)
#
# Exit code: 0 done, otherwise something was found, 77 skipped: cargo-deny cannot be installed here.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
. "$repository/tools/scripts/cargo-tool.sh"
cd "$repository"

need_cargo_tool cargo-deny cargo-deny 0.20.2
attend "$tool" --locked check --hide-inclusion-graph bans licenses sources

# The vulnerabilities are in a database that is fetched anew.
if attend timeout 300 "$tool" --locked fetch db; then
	attend "$tool" --locked check --disable-fetch advisories
else
	echo "skipped: known vulnerabilities (the advisory database cannot be fetched)"
fi
