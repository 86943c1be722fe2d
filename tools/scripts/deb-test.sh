#!/usr/bin/env bash
# Tests the Debian package of one architecture in a new Debian system: installs it, uses each thing that it
# brings, and purges it, after which the system must be as it was before.
#
# usage: deb-test.sh [ARCH]     amd64 or arm64 (under user-mode QEMU); this machine's if none
# environment: DEB_SUITE (Debian's suite, bookworm), DEB_MIRROR (mmdebstrap's own)
#
# Builds the package by deb.sh. Needs root and the packages of Debian from the network; keeps nothing of the system
# that it makes.
# Exit code: 0 passed, 1 failed, 2 wrong usage, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
. "$repository/tools/scripts/packages-env.sh"
cd "$repository"

command -v dpkg-deb >/dev/null || skip "needs dpkg: this is no Debian, and no system like it"
[ $# -le 1 ] || { sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2; }
case ${1-} in
amd64 | arm64) architecture=$1 ;;
'') architecture=$(dpkg --print-architecture) ;;
-h | --help) sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; exit 0 ;;
*) sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2 ;;
esac
foreign=no
[ "$architecture" = "$(dpkg --print-architecture)" ] || foreign=yes

package=$(debian_package "$architecture")

# Mounts and processes of the test are in namespaces of its own, and end with it.
if [ -z "${DEB_TEST_WORK-}" ]; then
	[ "$(id -u)" = 0 ] || skip "a new system can be made by root alone"
	need_packages mmdebstrap debian-archive-keyring pkg-config
	[ $foreign = no ] || need_packages qemu-user-static arch-test gcc-aarch64-linux-gnu libc6-dev-arm64-cross
	unshare --mount --pid --fork true 2>/dev/null || skip "namespaces for mounts and processes are not allowed here"
	tools/scripts/deb.sh "$architecture"
	if command -v lintian >/dev/null; then
		attend timeout 900 lintian --allow-root --fail-on error,warning --tag-display-limit 0 "$package" ||
			fail "lintian finds what breaks Debian's rules"
		echo "ok    Debian's rules, but for the exceptions in tools/packages/debian/lintian-overrides"
	else
		echo "skipped: Debian's rules (lintian is not installed)"
	fi
	# Removed here, outside, where nothing is mounted below it: the mounts end with their namespace.
	work=$(mktemp -d)
	litter+=("$work")
	chmod 755 "$work"
	DEB_TEST_WORK=$work attend unshare --mount --propagation private --pid --fork --kill-child=TERM --mount-proc \
		"$0" "$architecture"
	exit
fi
# Only unshare above starts this part, as the first process of its namespace.
[ $$ = 1 ] && [ -d "$DEB_TEST_WORK" ] || fail "DEB_TEST_WORK is for this script itself: unset it"
work=$DEB_TEST_WORK
root=$work/root

# Leaves the exit code as it is.
end_foreign_programs() {
	local code=$?
	[ ! -e "$foreign_entry" ] || echo -1 > "$foreign_entry" || true
	return $code
}

# Has the kernel start programs of arm64 by QEMU, unless it already does.
start_foreign_programs() {
	local files=/proc/sys/fs/binfmt_misc name=zynq-pgs-deb-test magic mask entry
	[ -e $files/register ] || mount -t binfmt_misc binfmt_misc $files || skip "the kernel has no binfmt_misc"
	for entry in "$files"/*; do
		[[ $entry = */register || $entry = */status ]] || ! grep -q -s aarch64 "$entry" || return 0
	done
	# The head of an ELF file of AArch64; any kind of program.
	magic='\x7fELF\x02\x01\x01\x00\x00\x00\x00\x00\x00\x00\x00\x00\x02\x00\xb7\x00'
	mask='\xff\xff\xff\xff\xff\xff\xff\x00\xff\xff\xff\xff\xff\xff\xff\xff\xfe\xff\xff\xff'
	# F: the kernel keeps the file open, so that it is found in the new system.
	foreign_entry=$files/$name
	trap 'end_foreign_programs || end_all; end_all' EXIT
	printf '%s' ":$name:M::$magic:$mask:$(command -v qemu-aarch64-static):F" > $files/register ||
		skip "the kernel takes no program for files of arm64"
}
[ $foreign = no ] || start_foreign_programs

# A minimal system, and the packages that the checks use. The shells and the unit do not depend on the architecture.
needed=(adduser bash-completion libc6 libgcc-s1 man-db pkg-config)
[ $foreign = yes ] || needed+=(fish systemd zsh)
echo "a new system: ${DEB_SUITE:-bookworm}, $architecture, with ${needed[*]}"
attend timeout 1500 mmdebstrap --quiet --mode=root --architectures="$architecture" --variant=minbase \
	--aptopt='APT::Sandbox::User "root"' --include="$(IFS=,; echo "${needed[*]}")" \
	"${DEB_SUITE:-bookworm}" "$root" ${DEB_MIRROR:+"$DEB_MIRROR"} > "$work/log" 2>&1 || {
	tail -n 20 "$work/log" >&2
	skip "no system can be made: is there a network?"
}
mount -t proc proc "$root/proc"
# Devices of its own: every devtmpfs is this machine's own /dev, and a removal there would reach the machine.
mount -t tmpfs tmpfs "$root/dev"
for device in "null 3" "zero 5" "full 7" "random 8" "urandom 9"; do
	# shellcheck disable=SC2086 # a name and a number
	set -- $device
	mknod -m 666 "$root/dev/$1" c 1 "$2"
done
ln -s /proc/self/fd "$root/dev/fd"
mount -t tmpfs tmpfs "$root/run"

within() { chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 HOME=/tmp "$@"; }
# Here dpkg, ldconfig and man-db log and cache by themselves, and groupadd keeps the last state of its files.
own=(-path ./proc -o -path ./dev -o -path ./run -o -path ./tmp -o -path ./var/log -o -path ./var/cache
	-o -path ./etc/group- -o -path ./etc/gshadow-)
# The names of all other files, with dpkg's.
names() { (cd "$root" && find . -xdev \( "${own[@]}" \) -prune -o -print) | sort; }
# Kinds, rights, owners and contents of all other files, without dpkg's.
contents() {
	local here=(. -xdev \( "${own[@]}" -o -path ./var/lib/dpkg \) -prune -o)
	(
		cd "$root"
		find "${here[@]}" -printf '%M %u %g %p %l\n' | sort -k 4
		find "${here[@]}" -type f -print0 | sort -z | xargs -0 md5sum
	)
}

checked=0
# Runs a check; its output must have a text, and nothing may come to stderr.
shows() {
	local what=$1 expected=$2 said
	shift 2
	said=$("$@" 2>"$work/errors") || { cat "$work/errors" >&2; fail "$what: failed: $*"; }
	[ ! -s "$work/errors" ] || { cat "$work/errors" >&2; fail "$what: complains: $*"; }
	grep -q -F -e "$expected" <<<"$said" || fail "$what: no '$expected' in: $said"
	echo "ok    $what: $expected"
	checked=$((checked + 1))
}

# The copy of the package is there before and after.
cp "$package" "$root/zynq-pgs.deb"
# A first change by dpkg makes its logs and the copy of its state.
within dpkg --purge no-such-package >/dev/null 2>&1 || true
names > "$work/names-before"
contents > "$work/before"
within dpkg -i /zynq-pgs.deb

shows "the tool" "pgs $version" within pgs --version
cp -r tests/golden/pile5_step60 "$root/tmp/step"
shows "a step" "out_pos.npy: 0 of 378 values differ in bits" within pgs solve /tmp/step --compare --board emulated
for group in pgs pgs-serve; do shows "the group" "$group:x:" within getent group "$group"; done

# In user-mode QEMU man's filter of system calls does not work.
page() { within MAN_DISABLE_SECCOMP=1 MANWIDTH=80 man --warnings "$1"; }
shows "man pgs" "Steps rigid bodies on the zynq-pgs accelerator" page pgs
verbs=$(within pgs --help | sed -n '/^Commands:/,/^$/s/^  \([a-z][a-z0-9-]*\) .*/\1/p' | grep -v -x help || true)
[ -n "$verbs" ] || fail "pgs --help lists no verb"
for verb in $verbs; do shows "man pgs-$verb" "EXAMPLES" page "pgs-$verb"; done

# shellcheck disable=SC2016 # for the shell within
complete_bash='. /usr/share/bash-completion/bash_completion
_completion_loader pgs || [ $? = 124 ]
COMP_WORDS=(pgs serv) COMP_CWORD=1
$(complete -p pgs | sed "s/.*-F \([^ ]*\).*/\1/") pgs serv pgs && echo "${COMPREPLY[*]}"'
shows "completion in bash" serve within bash -c "$complete_bash"
if [ $foreign = no ]; then
	# shellcheck disable=SC2016
	shows "completion in zsh" _pgs within zsh -fc 'autoload -U compinit && compinit -u -D && echo $_comps[pgs]'
	shows "completion in zsh, its syntax" accepted within zsh -fc 'zsh -n /usr/share/zsh/vendor-completions/_pgs && echo accepted'
	shows "completion in fish" serve within fish --no-config -c 'source /usr/share/fish/vendor_completions.d/pgs.fish; complete -C "pgs serv"'
fi

# The directories of the system are left out as the compiler's own.
flags=$(within pkg-config --cflags zynq-pgs)
[ -z "${flags// /}" ] || fail "pkg-config --cflags: expected nothing, found $flags"
shows "pkg-config --cflags, all" "-I/usr/include" within PKG_CONFIG_ALLOW_SYSTEM_CFLAGS=1 pkg-config --cflags zynq-pgs
shows "pkg-config --libs" "-lzynq_pgs_c" within pkg-config --libs zynq-pgs
shows "pkg-config --modversion" "$version" within pkg-config --modversion zynq-pgs

# A C program, built here against the installed files, runs there with both libraries.
triplet=x86_64-linux-gnu
[ "$architecture" != arm64 ] || triplet=aarch64-linux-gnu
if command -v "$triplet-gcc" >/dev/null; then
	example=$root/usr/share/doc/zynq-pgs/examples/cube.c
	flags() { PKG_CONFIG_SYSROOT_DIR=$root PKG_CONFIG_LIBDIR=$root/usr/lib/$triplet/pkgconfig PKG_CONFIG_ALLOW_SYSTEM_CFLAGS=1 \
		PKG_CONFIG_ALLOW_SYSTEM_LIBS=1 pkg-config "$@" zynq-pgs; }
	# The compiler's own headers come first.
	mkdir "$work/include"
	cp "$root/usr/include/zynq_pgs.h" "$work/include"
	# shellcheck disable=SC2046 # several words
	"$triplet-gcc" "$example" -I "$work/include" "$root/usr/lib/$triplet/libzynq_pgs_c.so" -o "$root/tmp/shared"
	# shellcheck disable=SC2046
	"$triplet-gcc" "$example" -I "$work/include" "$root/usr/lib/$triplet/libzynq_pgs_c.a" \
		$(flags --static --libs-only-l | sed 's/-lzynq_pgs_c//') -o "$root/tmp/static"
	shows "a C program, shared" "digest" within /tmp/shared
	shows "a C program, static" "$(within /tmp/shared | tail -n 1)" within /tmp/static
else
	echo "skipped: a C program ($triplet-gcc is not installed)"
fi

# The unit's command, as a user who is in its group; and a driver in that group, which has no right on a real board.
if [ $foreign = no ]; then
	shows "the unit, by systemd" accepted within sh -c 'systemd-analyze verify --man=no pgs-serve.service && echo accepted'
	shows "the unit, enabled by nothing" disabled within sh -c 'systemctl is-enabled pgs-serve.service || true'
	# Whatever the administrator enables goes, too.
	within systemctl enable pgs-serve.service 2>/dev/null
fi
# shellcheck disable=SC2016 # the unit's own dollar
command=$(sed -n 's/^ExecStart=//p' "$root/usr/lib/systemd/system/pgs-serve.service" | sed 's/ \$PGS_SERVE_OPTIONS//')
unit_group=$(sed -n 's/^Group=//p' "$root/usr/lib/systemd/system/pgs-serve.service")
! grep -q "GROUP=\"$unit_group\"" "$root/usr/lib/udev/rules.d/99-zynq-pgs.rules" || fail "the unit's group has real boards"
group=$(within getent group "$unit_group" | cut -d: -f3)
in_group() { within setpriv --reuid 65534 --regid "$group" --clear-groups "$@"; }
install -d -m 750 -o 65534 -g "$group" "$root/run/pgs"
# shellcheck disable=SC2016 # for the shell within
(
	umask 007
	in_group sh -c "echo \$\$ > /tmp/server; exec $command" > "$work/served" 2>&1
) &
server=$!
waited=0
until [ -S "$root/run/pgs/board" ]; do
	[ $((waited += 1)) -le 300 ] || { cat "$work/served"; fail "the unit's command opens no socket"; }
	sleep 0.1
done
shows "a served board" "digest" in_group pgs run --board socket:/run/pgs/board --grid 3x3x3 --steps 2
mode=$(stat -c %a "$root/run/pgs/board")
[ "$mode" = 770 ] || [ "$mode" = 660 ] || fail "the socket has the rights $mode, and the group needs to write"
kill -TERM "$(cat "$root/tmp/server")"
wait "$server" || { cat "$work/served"; fail "SIGTERM does not end the server in good order"; }
[ -z "$(ls -A "$root/run/pgs")" ] || fail "a file stays after SIGTERM"
echo "ok    SIGTERM ends the server and removes the socket"

[ -e "$root/usr/lib/udev/rules.d/99-zynq-pgs.rules" ] || fail "no udev rule"
for overlay in zynq-pgs zynq-pgs-region zynq-pgs-nodes; do
	fdtget -l "$root/usr/share/zynq-pgs/overlays/$overlay.dtbo" / >/dev/null || fail "$overlay.dtbo is no device tree"
done
echo "ok    3 overlays"

# Again, as at an upgrade, then off.
within dpkg -i /zynq-pgs.deb >/dev/null
within dpkg --purge zynq-pgs
names > "$work/names-after"
contents > "$work/after"
diff "$work/names-before" "$work/names-after" || fail "dpkg --purge leaves the files above, or has removed some"
diff "$work/before" "$work/after" || fail "dpkg --purge leaves the changes above"
! find "$root" -xdev -name '*pgs*' ! -path "$root/zynq-pgs.deb" ! -path "$root/tmp/*" ! -path "$root/run/*" | grep . ||
	fail "dpkg --purge leaves the files above"
echo "ok    after dpkg --purge $(wc -l < "$work/names-after") files and folders, as before"
echo "$checked checks and a purge on $architecture"
