// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/table_rows.h"

#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"

#include <algorithm>
#include <utility>

namespace subvol::cli {

using namespace internal;

TableRows::TableRows(std::string name, std::string_view text, char separator)
    : name_(std::move(name)), text_(text), separator_(separator) {
  require_no_utf16(name_, text);
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  if (text_.starts_with(kMark)) text_.remove_prefix(kMark.size());
}

std::string TableRows::quoted_field() {
  std::string field;
  for (++at_;; ++at_) {
    const std::size_t quote = std::min(text_.find('"', at_), text_.size());
    field += text_.substr(at_, quote - at_);
    if (quote == text_.size()) throw InputError(place() + ": expected another \" to end the field");
    at_ = quote + 1;
    if (at_ == text_.size() || text_[at_] != '"') break;
    field += '"';
  }
  line_ += static_cast<std::size_t>(std::count(field.begin(), field.end(), '\n'));
  return field;
}

bool TableRows::next(std::vector<std::string>& fields) {
  const auto is_at_line_end = [&] {
    return at_ == text_.size() || text_[at_] == '\n' || text_.substr(at_).starts_with("\r\n");
  };
  const auto pass_line_end = [&] {
    at_ = std::min(text_.find('\n', at_), text_.size() - 1) + 1;
    ++line_;
  };
  while (at_ < text_.size() && is_at_line_end()) pass_line_end();
  if (at_ == text_.size()) return false;
  row_line_ = line_;
  fields.clear();
  for (;; ++at_) {
    if (at_ < text_.size() && text_[at_] == '"') {
      fields.push_back(quoted_field());
    } else {
      const std::size_t begin = at_;
      while (!is_at_line_end() && text_[at_] != separator_) ++at_;
      fields.emplace_back(text_.substr(begin, at_ - begin));
    }
    if (is_at_line_end()) break;
    if (text_[at_] != separator_) throw InputError(place() + ": expected a separator after a field in quotes");
  }
  if (at_ < text_.size()) pass_line_end();
  return true;
}

}  // namespace subvol::cli
