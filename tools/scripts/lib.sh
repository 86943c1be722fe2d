# This file holds what the scripts of this folder share. To be sourced by bash.

# The exit code of a script that cannot do its work on this machine, and says why.
readonly SKIPPED=77

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
target_root=${CARGO_TARGET_DIR:-$repository/target}
[[ $target_root = /* ]] || target_root=$PWD/$target_root

fail() { echo "error: $*" >&2; exit 1; }
skip() { echo "skipped: $*" >&2; exit "$SKIPPED"; }

# Runs apt-get, and waits for another one that holds its locks.
apt() {
	local log try
	log=$(mktemp)
	for try in $(seq 30); do
		if timeout 600 apt-get -q -o DPkg::Lock::Timeout=300 -o APT::Sandbox::User=root "$@" > "$log" 2>&1; then
			rm -f "$log"
			return 0
		fi
		grep -q -E 'Unable to (lock|acquire)|rename failed' "$log" || break
		sleep 5
	done
	tail -n 5 "$log" >&2
	rm -f "$log"
	return 1
}

# The packages among the arguments that are not installed.
missing_packages() {
	local package
	for package in "$@"; do
		[ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" = installed ] ||
			printf '%s ' "$package"
	done
}

# Installs the Debian packages that are not there yet; skips the script where that cannot be done.
need_packages() {
	local missing
	command -v dpkg-query apt-get >/dev/null ||
		skip "needs Debian's packages $*, and this is no Debian (no apt-get)"
	missing=$(missing_packages "$@")
	[ -n "$missing" ] || return 0
	local by_hand="dpkg --add-architecture arm64 && apt-get update && apt-get install ${missing% }"
	[ "$(id -u)" = 0 ] || skip "these packages are missing; as root: $by_hand"
	echo "installing ${missing% }"
	need_lists
	# shellcheck disable=SC2086 # a list of words
	apt install -y --no-install-recommends $missing ||
		skip "these packages cannot be installed: ${missing% }"
}

# Brings the package lists up to date, with those of arm64; an ordinary user has to take them as
# they are.
need_lists() {
	if ! dpkg --print-foreign-architectures | grep -qx arm64; then
		[ "$(id -u)" = 0 ] || skip "needs the packages of arm64; as root: dpkg --add-architecture arm64 && apt-get update"
		dpkg --add-architecture arm64
	fi
	if [ -z "${lists_are_new:-}" ] && [ "$(id -u)" = 0 ]; then
		apt update || skip "the package lists cannot be fetched"
		lists_are_new=yes
	fi
}
