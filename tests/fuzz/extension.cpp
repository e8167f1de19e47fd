// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/fuzz/bytes_as_file.h"

constinit const std::string_view subvol::fuzz::kExtension = SUBVOL_FUZZ_EXTENSION;
