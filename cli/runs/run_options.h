// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <nlohmann/json.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace subvol::cli {

/// Keeps the order of entries as written: reports list them in the order that people expect.
using Json = nlohmann::ordered_json;

/// Returns the three coordinates as an array.
inline Json point_json(const Vec3& point) { return {point.x(), point.y(), point.z()}; }

/// Options that several verbs share.
struct RunOptions {
  std::vector<std::string> outputs;  ///< -o, as given
  std::string report;                ///< empty: none
  bool force = false, quiet = false;
  int threads = 0;               ///< 0: all cores
  std::size_t memory_limit = 0;  ///< bytes; 0: none
  unsigned seed = 0;
  std::string progress;            ///< bar, plain, json, none; empty: depends on stderr
  std::string checkpoint, resume;  ///< empty: none
  std::string references;          ///< cell data that become the cells' references; empty: the usual ones
  double every_seconds = 60;       ///< least time between two writes of the checkpoint
};

/// Sets OpenMP's number of threads from --threads, here and nowhere else, and makes --memory-limit the process's own
/// limit on data: allocations beyond it fail (`std::bad_alloc`).
void apply_resources(const RunOptions& options);

/// True if a word is a number from low to high, and nothing else.
bool is_number_in(const std::string& word, double low, double high);
/// Parses a length in the mesh's unit, or in percent (%) of a diagonal. UsageError, naming the option: neither.
double parse_length(const std::string& option, const std::string& text, double diagonal);
/// Replaces what is not UTF-8 by U+FFFD: file names need not be UTF-8.
std::string as_utf8(const std::string& text);

}  // namespace subvol::cli
