# Functions and variables that the scripts of this folder share. To be sourced by bash.

# The exit code of a script that cannot do its work on this machine, and says why.
readonly SKIPPED=77

# A variable that is blank counts as unset, for cargo too.
for variable in CARGO_TARGET_DIR PGS_VECTORS STEPS QEMU BOOT_LIMIT TEST_LIMIT VALGRIND_LIMIT MIRI_LIMIT \
	MIRIFLAGS BOARD CHECKS TREE SIMULATOR; do
	[[ ${!variable-set} = *[![:space:]]* ]] || unset "$variable"
done

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
target_root=${CARGO_TARGET_DIR:-$repository/target}
[[ $target_root = /* ]] || target_root=$PWD/$target_root

fail() { echo "error: $*" >&2; exit 1; }
skip() { echo "skipped: $*" >&2; exit "$SKIPPED"; }

# The compiler's flags that keep the builder's folders out of a program that is given away.
nameless_flags() {
	local cargo=${CARGO_HOME:-$HOME/.cargo} sysroot
	sysroot=$("${RUSTC:-rustc}" --print sysroot)
	[[ $repository$cargo$sysroot != *[[:space:]]* ]] || fail "cargo takes no flag with a blank: $repository, $cargo, $sysroot"
	printf -- '--remap-path-prefix=%s=%s ' "$repository" /zynq-pgs "$cargo" /cargo "$sysroot" /rust
}

# Fails if one of the files has a path of the builder in it.
nameless() {
	local file path found
	for file in "$@"; do
		for path in "$repository/" "${CARGO_HOME:-$HOME/.cargo}/" "$HOME/."; do
			found=$({ grep -a -o -F -e "$path" "$file" || true; } | wc -l)
			[ "$found" = 0 ] || fail "$file has $found paths of the builder: $path"
		done
	done
	echo "no path of the builder in ${*##*/}"
}

# What a script leaves neither running nor lying about, whatever ends it.
declare -A running=()
litter=()
end_all() {
	local code=$?
	trap - EXIT
	[ ${#running[@]} = 0 ] || kill "${!running[@]}" 2>/dev/null || true
	wait
	[ ${#litter[@]} = 0 ] || rm -rf --one-file-system "${litter[@]}"
	exit "$code"
}
trap end_all EXIT
trap 'exit 129' HUP
trap 'exit 130' INT
trap 'exit 143' TERM

# Starts a program that ends with the script; the kernel sees to it where the script is killed.
begin() {
	local tied=(setpriv --pdeathsig TERM)
	command -v setpriv >/dev/null || tied=()
	"${tied[@]}" "$@" &
	running[$!]=
}

# Waits for a program that was begun; its exit code. A signal ends the wait, and the script.
await() {
	local code=0
	wait "$1" || code=$?
	unset "running[$1]"
	return "$code"
}

# Runs a program that ends with the script. One that is simply run keeps signals from the script.
attend() {
	begin "$@"
	await $!
}

# Runs apt-get; tries again while another one holds its locks, and what hangs. A quarter of an hour
# is the most that it takes.
apt() {
	local log code end=$((SECONDS + 600))
	log=$(mktemp)
	while :; do
		code=0
		DEBIAN_FRONTEND=noninteractive timeout --kill-after=10 300 apt-get -q \
			-o DPkg::Lock::Timeout=60 -o APT::Sandbox::User=root "$@" > "$log" 2>&1 || code=$?
		[ $code != 0 ] || break
		[ $code = 124 ] || grep -q -E 'Unable to (lock|acquire)|rename failed' "$log" || break
		[ $SECONDS -lt $end ] || break
		sleep 5
	done
	[ $code = 0 ] || tail -n 5 "$log" >&2
	rm -f "$log"
	return $code
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
	local by_hand="apt-get update && apt-get install ${missing% }"
	case $missing in *:arm64*) by_hand="dpkg --add-architecture arm64 && $by_hand" ;; esac
	[ "$(id -u)" = 0 ] || skip "these packages are missing; as root: $by_hand"
	echo "installing ${missing% }"
	case $missing in *:arm64*) need_arm64 ;; esac
	need_lists
	# What may hang is fetched first: dpkg is not to be stopped between two packages.
	# shellcheck disable=SC2086 # a list of words
	apt install -y --no-install-recommends --download-only $missing &&
		apt install -y --no-install-recommends $missing ||
		skip "these packages cannot be installed: ${missing% }"
}

# Has apt know the packages of arm64.
need_arm64() {
	! dpkg --print-foreign-architectures | grep -qx arm64 || return 0
	[ "$(id -u)" = 0 ] ||
		skip "needs the packages of arm64; as root: dpkg --add-architecture arm64 && apt-get update"
	dpkg --add-architecture arm64
	lists_are_new=
}

# Brings the package lists up to date; an ordinary user has to take them as they are.
need_lists() {
	if [ -z "${lists_are_new:-}" ] && [ "$(id -u)" = 0 ]; then
		apt update || skip "the package lists cannot be fetched"
		lists_are_new=yes
	fi
}
