#!/usr/bin/env bash
# Makes and builds the package of each crate that is made to be published, from a copy of the sources in which
# publishing is allowed. Publishes nothing.
#
# usage: cargo-package.sh [--no-verify]
#   --no-verify   makes the packages, and does not build them
#
# The crates are those that take `publish` from the workspace; a release changes that one line of Cargo.toml.
# The packages stay in target/packages/crates.
# Exit code: 0 done, 1 a package cannot be made or does not build, 2 wrong usage, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
. "$repository/tools/scripts/packages-env.sh"
cd "$repository"

# The largest package, in bytes: golden vectors or Verilog in a package would be a mistake.
readonly largest=500000
verify=()
case ${1-} in
'') ;;
--no-verify) verify=(--no-verify) ;;
-h | --help) sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; exit 0 ;;
*) sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2 ;;
esac
command -v cargo >/dev/null || skip "needs cargo in PATH"
# Packages that need each other are built before any of them is published.
oldest=1.90.0
found=$(cargo --version | cut -d' ' -f2)
[ "$(printf '%s\n' "$oldest" "$found" | sort -V | head -n 1)" = "$oldest" ] || skip "cargo is $found, and this needs $oldest"

mapfile -t manifests < <(grep -l '^publish.workspace = true' Cargo.toml bitstream-model/Cargo.toml bitstream-model/*/Cargo.toml tools/*/Cargo.toml)
crates=()
for manifest in "${manifests[@]}"; do crates+=("$(sed -n 's/^name = "\(.*\)"/\1/p' "$manifest" | head -n 1)"); done
[ ${#crates[@]} != 0 ] || fail "no crate takes 'publish' from the workspace"

copy=$(mktemp -d)
litter+=("$copy")
git ls-files -z --cached --others --exclude-standard | tar --null --files-from=- --ignore-failed-read -cf - | tar -xf - -C "$copy"
grep -q '^publish = false$' "$copy/Cargo.toml" || fail "Cargo.toml does not say 'publish = false' for the workspace"
sed -i 's/^publish = false$/publish = ["crates-io"]/' "$copy/Cargo.toml"

export CARGO_TARGET_DIR=$target_root/cargo-package CARGO_INCREMENTAL=0 CARGO_PROFILE_DEV_DEBUG=0
rm -rf "$CARGO_TARGET_DIR/package"
options=()
for crate in "${crates[@]}"; do options+=(-p "$crate"); done
log=$copy/log
attend timeout 3000 cargo package --manifest-path "$copy/Cargo.toml" --locked --allow-dirty \
	${verify[@]+"${verify[@]}"} "${options[@]}" 2>&1 | tee "$log" || fail "cargo cannot package the crates, as above"
# A test that a package leaves out needs the golden vectors or another crate's binaries; profiles of the workspace name
# crates that not every package needs.
! grep '^warning: ' "$log" | grep -v -E '^warning: (ignoring (test|benchmark)|profile package spec) ' || fail "cargo warns, as above"

rm -rf "$packages/crates"
mkdir -p "$packages/crates"
for crate in "${crates[@]}"; do
	package=$(echo "$CARGO_TARGET_DIR/package/$crate"-[0-9]*.crate)
	[ -s "$package" ] || fail "no package of $crate"
	bytes=$(stat -c %s "$package")
	[ "$bytes" -le $largest ] || fail "$package has $bytes bytes; $largest are the most"
	# What a package has to tell about itself.
	manifest=$(tar -xOf "$package" --wildcards '*/Cargo.toml')
	for key in description license rust-version keywords categories documentation; do
		grep -q "^$key = " <<<"$manifest" || fail "$crate: no $key in its Cargo.toml"
	done
	for licence in LICENSE-MIT LICENSE-APACHE; do
		tar -xOf "$package" --wildcards "*/$licence" 2>/dev/null | cmp -s - "$licence" || fail "$crate: no $licence in its package"
	done
	cp "$package" "$packages/crates"
	echo "$(basename "$package"): $bytes bytes"
done
echo "${#crates[@]} crates, ${verify[*]:-each built from its package}"
