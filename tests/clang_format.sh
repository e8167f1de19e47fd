#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Compares the sources with .clang-format. usage: clang_format.sh CLANG_FORMAT SOURCE_FOLDER
# Exit status 0 if all are laid out so; otherwise the places are printed.
set -eu
cd "$2"
find bench cli export fit python samples shell subvol tests -name '*.h' -print0 -o -name '*.cpp' -print0 |
  xargs -0 "$1" --dry-run -Werror
