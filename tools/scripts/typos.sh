#!/usr/bin/env bash
# Looks for misspelt words in all files; _typos.toml lists the words of the trade that typos does not know.
#
# usage: typos.sh [OPTION...]     options of typos, such as --write-changes
# environment: INSTALL_LIMIT (seconds for building typos, 900)
#
# Exit code: 0 done, otherwise misspelt words were found, 77 skipped: typos cannot be installed here.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
. "$repository/tools/scripts/cargo-tool.sh"
cd "$repository"

# Another version knows other words.
need_cargo_tool typos typos-cli 1.52.0
attend "$tool" --config _typos.toml "$@"
echo "no misspelt word"
