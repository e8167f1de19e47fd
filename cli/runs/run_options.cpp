// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/run_options.h"

#include "cli/runs/exit_status.h"
#include "subvol/base/text_scanner.h"

#include <omp.h>
#include <sys/resource.h>

#include <algorithm>
#include <charconv>
#include <system_error>

namespace subvol::cli {

using namespace internal;

void apply_resources(const RunOptions& options) {
  if (options.threads > 0) omp_set_num_threads(options.threads);
  if (options.memory_limit == 0) return;
  rlimit limit{};
  getrlimit(RLIMIT_DATA, &limit);
  limit.rlim_cur = std::min<rlim_t>(options.memory_limit, limit.rlim_max);
  setrlimit(RLIMIT_DATA, &limit);
}

bool is_number_in(const std::string& word, double low, double high) {
  double value = 0;
  const char* end = word.data() + word.size();
  const auto [rest, error] = std::from_chars(word.data(), end, value);
  return error == std::errc{} && rest == end && value >= low && value <= high;
}

double parse_length(const std::string& option, const std::string& text, double diagonal) {
  const bool percent = text.ends_with('%');
  const std::string number = percent ? text.substr(0, text.size() - 1) : text;
  if (!is_number_in(number, 1e-300, 1e300))
    throw UsageError(option + ": must be a positive length, or a percentage as 2%, not " + text);
  return *parse_number(number) * (percent ? diagonal / 100 : 1);
}

std::string as_utf8(const std::string& text) {
  return Json::parse(Json(text).dump(-1, ' ', false, Json::error_handler_t::replace)).get<std::string>();
}

}  // namespace subvol::cli
