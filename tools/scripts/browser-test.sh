#!/usr/bin/env bash
# Opens the pages that pgs writes in a headless Chromium, uses them, and measures frames a second. A page that
# reports an error, stays uniform, ignores a control or asks the network for something fails it.
#
# usage: browser-test.sh                     a run while it steps, two small scenes, and the quick report
#        browser-test.sh KIND=PAGE.html...   these pages; kinds are the functions of browser/pages.js: report, view,
#                                            live (with the address of a run)
#
# Screenshots go to target/browser. Needs Node.js, npm and Chromium; installs chromium (Debian's package) where it
# may, and fetches playwright-core with npm.
# environment: CHROMIUM (the browser's path)
#
# Exit code: 0 passed, 1 failed, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

case ${1-} in
-h | --help) sed -n '2,/^set /s/^# \{0,1\}//p' "$0"; exit 0 ;;
esac

pages=()
for page in "$@"; do
	case $page in
	live=*) pages+=("$page") ;;
	*) pages+=("${page%%=*}=$(realpath "${page#*=}")") ;;
	esac
done
cd "$repository"
command -v node >/dev/null && command -v npm >/dev/null || need_packages nodejs npm
browser=${CHROMIUM:-$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)}
if [ -z "$browser" ]; then
	need_packages chromium
	browser=$(command -v chromium) || skip "chromium is installed and not found"
fi

# The packages of the lock file, beside what cargo builds.
work=$target_root/browser
mkdir -p "$work"
cp tools/scripts/browser/package.json tools/scripts/browser/package-lock.json "$work"
if ! cmp -s "$work/package-lock.json" "$work/node_modules/.lock"; then
	(cd "$work" && timeout 300 npm ci --ignore-scripts --no-audit --no-fund > npm.log 2>&1) ||
		{ tail -n 5 "$work/npm.log" >&2; skip "npm cannot fetch playwright-core"; }
	cp "$work/package-lock.json" "$work/node_modules/.lock"
fi

if [ ${#pages[@]} = 0 ]; then
	attend cargo build --quiet --locked -p pgs
	pgs=$target_root/debug/pgs
	export PGS_BOARD=emulated
	attend "$pgs" run --grid 6x5x6 --steps 120 --view "$work/cubes.html" > /dev/null
	attend "$pgs" run --scene shapes --grid 4x4x4 --steps 180 --view "$work/shapes.html" > /dev/null
	# The golden step is small. A report on Bullet's full step is minutes shorter than one on our own pile.
	input=tests/golden/pile5_step60
	[ -z "${PGS_VECTORS-}" ] || input=$PGS_VECTORS/full_step186
	SECONDS=0
	attend "$pgs" thesis --all --out "$work/report" --quick --input "$input" > /dev/null
	echo "thesis --all --quick: $SECONDS s"
	rm -f "$work/live.pipe" && mkfifo "$work/live.pipe"
	exec 3<> "$work/live.pipe"
	begin "$pgs" run --scene shapes --grid 3x4x3 --beside-cold=false --steps 20000 --live 0 > "$work/live.txt" 2>&3
	run=$!
	read -r _ _ url <&3
	pages=("live=$url" "view=$work/cubes.html" "view=$work/shapes.html" "report=$work/report/thesis.html")
fi
NODE_PATH=$work/node_modules attend node tools/scripts/browser/browser-test.js "$browser" "$work" "${pages[@]}"

# The page is closed, and the run goes on to its last step.
if [ -n "${run-}" ]; then
	kill -0 "$run" 2>/dev/null && echo "live: the run goes on without the page"
	await "$run" && grep ^digest "$work/live.txt" || fail "the run that was watched has failed"
fi
