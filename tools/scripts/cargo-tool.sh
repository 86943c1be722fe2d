# Finds a tool that is built by `cargo install`, or builds it below the target folder. To be sourced after
# lib.sh.

# Sets `tool` to the program `$1`: the one in PATH, or else version `$3` of the package `$2`.
need_cargo_tool() {
	local program=$1 package=$2 version=$3 root=$target_root/tools
	tool=$(command -v "$program" || true)
	[ -z "$tool" ] || return 0
	tool=$root/bin/$program
	[ ! -x "$tool" ] || return 0
	echo "installing $package $version in $root"
	attend timeout "${INSTALL_LIMIT:-900}" \
		cargo install --quiet --locked --root "$root" --version "$version" "$package" ||
		skip "$package $version cannot be installed here; by hand: cargo install --locked $package"
}
