// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace subvol::cli {

/// Ordered as written: reports list things in the order people expect.
using Json = nlohmann::ordered_json;

/// Options that several verbs share.
struct RunOptions {
  std::vector<std::string> outputs;  ///< -o, as given
  std::string report;                ///< empty: none
  bool force = false, quiet = false;
  int threads = 0;                   ///< 0: all cores
  std::size_t memory_limit = 0;      ///< bytes; 0: none
  unsigned seed = 0;
  std::string progress;              ///< bar, plain, json, none; empty: by what stderr is
  std::string checkpoint, resume;    ///< empty: none
  std::string references;            ///< cell data that become the cells' references; empty: those that are meant
  double every_seconds = 60;         ///< between two writes of the checkpoint, at least
};

/// --threads alone sets OpenMP's number of threads, here and nowhere else. --memory-limit becomes the process's own
/// limit on data: what goes beyond it fails to be allocated (`std::bad_alloc`).
void apply_resources(const RunOptions& options);

/// Whether a word is a number from low to high, and nothing else.
bool is_number_in(const std::string& word, double low, double high);
/// A length in the mesh's unit, or with % of a diagonal. UsageError, naming the option: neither.
double parse_length(const std::string& option, const std::string& text, double diagonal);
/// A text with U+FFFD in place of what is not UTF-8, as names of files need not be.
std::string as_utf8(const std::string& text);

}  // namespace subvol::cli
