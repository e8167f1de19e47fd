#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Compiles main.cpp with the flags of pkg-config alone, and runs it.
# usage: with_pkg_config.sh PREFIX COMPILER [FLAG ...]
set -eu
prefix="$1"
shift
PKG_CONFIG_PATH="$(dirname "$(find "$prefix" -name subvol.pc)")"
export PKG_CONFIG_PATH
# shellcheck disable=SC2046  # a list of flags
"$@" -std=c++20 "$(dirname "$0")/main.cpp" -o with_pkg_config $(pkg-config --cflags --libs subvol)
LD_LIBRARY_PATH="$(pkg-config --variable=libdir subvol)" ./with_pkg_config
