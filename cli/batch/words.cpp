// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/words.h"

#include "subvol/base/error.h"

namespace subvol::cli {

std::vector<std::string> split_words(std::string_view text) {
  std::vector<std::string> words;
  bool is_open = false;  // a word has begun; it may still be empty, as in ''
  char quote = 0;
  for (const char c : text) {
    if (quote != 0) {
      if (c == quote)
        quote = 0;
      else
        words.back() += c;
      continue;
    }
    if (c == ' ' || c == '\t') {
      is_open = false;
      continue;
    }
    if (!is_open) words.emplace_back();
    is_open = true;
    if (c == '\'' || c == '"')
      quote = c;
    else
      words.back() += c;
  }
  if (quote != 0) throw InputError(std::string("expected another ") + quote + " to end what the first one begins");
  return words;
}

}  // namespace subvol::cli
