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
# The other two are workspaces of their own.
manifests=(Cargo.toml tools/python/Cargo.toml tools/clients/rapier/Cargo.toml)
deny() {
	for manifest in "${manifests[@]}"; do
		attend "$tool" --locked --manifest-path "$repository/$manifest" check --hide-inclusion-graph "$@"
	done
}
deny bans licenses sources

# The vulnerabilities are in a database that is fetched anew.
if attend timeout 300 "$tool" --locked fetch db; then
	deny --disable-fetch advisories
else
	echo "skipped: known vulnerabilities (the advisory database cannot be fetched)"
fi
