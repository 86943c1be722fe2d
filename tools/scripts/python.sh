#!/usr/bin/env bash
# Builds the wheel of tools/python, which no other build compiles, without a network; installs it in a new environment,
# and runs its tests, its example and the MuJoCo client there.
#
# usage: python.sh
#
# Exit code: 0 done, 1 a test fails or something does not build, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

command -v cargo >/dev/null || skip "needs cargo in PATH"
python3 -c 'import ensurepip, venv' 2>/dev/null || need_packages python3 python3-venv
cd "$repository"
export CARGO_TARGET_DIR=$target_root/python PYTHONDONTWRITEBYTECODE=1 PIP_DISABLE_PIP_VERSION_CHECK=1
manifest=tools/python/Cargo.toml

version() { sed -n 's/^version = "\(.*\)"/\1/p' "$1" | head -n 1; }
for file in $manifest tools/python/pyproject.toml; do
	[ "$(version $file)" = "$(version Cargo.toml)" ] || fail "$file has another version than Cargo.toml"
done

# Everything from the registries first.
work=$(mktemp -d)
litter+=("$work")
attend python3 -m venv "$work/build"
attend python3 -m venv "$work/run"
fetched() {
	local log=$work/log
	attend timeout 600 "$@" > "$log" 2>&1 && return
	cat "$log" >&2
	! grep -q -e '--locked' "$log" || fail "Cargo.lock of tools/python does not fit its Cargo.toml"
	skip "a registry is not reachable: $*"
}
fetched cargo fetch --quiet --locked --manifest-path $manifest
fetched "$work/build/bin/pip" install --quiet 'maturin>=1.9.4,<2'
download() { "$1" "$work/build/bin/pip" download --quiet --only-binary :all: --dest "$work/wheels" "${@:2}"; }
packages=(numpy pytest)
download fetched "${packages[@]}"
for package in gymnasium matplotlib mujoco; do
	if download attend "$package" 2>/dev/null; then
		packages+=("$package")
	else
		echo "skipped: what needs $package, which cannot be fetched"
	fi
done

# From here on there is no network, or cargo and pip are told to leave it alone.
export CARGO_NET_OFFLINE=true PIP_NO_INDEX=1 PIP_FIND_LINKS=$work/wheels
alone=()
for without in "unshare --net" "unshare --map-root-user --net"; do
	if $without true 2>/dev/null; then
		read -r -a alone <<< "$without"
		break
	fi
done
echo "network: ${alone[*]:-told to leave it alone}"
attend_alone() { attend ${alone[@]+"${alone[@]}"} "$@"; }

# No other stage reads these sources.
! cargo fmt --version >/dev/null 2>&1 || attend cargo fmt --check --manifest-path $manifest
! cargo clippy --version >/dev/null 2>&1 ||
	attend_alone cargo clippy --release --quiet --locked --manifest-path $manifest -- -D warnings
PATH=$work/build/bin:$PATH attend_alone "$work/build/bin/pip" wheel --quiet --no-build-isolation --no-deps \
	--wheel-dir "$work/wheels" tools/python
echo "built $(basename "$work"/wheels/zynq_pgs-*.whl) after $SECONDS s"

attend_alone "$work/run/bin/pip" install --quiet zynq-pgs "${packages[@]}"
(cd tools/python && attend_alone "$work/run/bin/python" -m pytest -q -rs -p no:cacheprovider)
if [[ " ${packages[*]} " = *" matplotlib "* ]]; then picture=$work/pile.png; else picture=; fi
attend_alone "$work/run/bin/python" tools/python/examples/pile.py ${picture:+"$picture"}
attend_alone "$work/run/bin/python" tools/clients/mujoco/board_solver.py || [ $? = $SKIPPED ]
echo "python: $SECONDS s"
