// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace subvol::cli {

/// Reads the rows of a table in text (RFC 4180): fields are parted by a character; "fields in quotes" may hold it, line
/// ends, and quotes as "". Lines end with LF or CR LF. Lines without any character are skipped, and so is a byte order
/// mark at the start.
class TableRows {
 public:
  /// name: the file's name for messages; text must outlive the object. InputError: as `require_no_utf16`.
  TableRows(std::string name, std::string_view text, char separator);

  /// Reads the next row into `fields`; returns false at the end of the text. InputError, with the line: a quote is not
  /// closed, or is followed by something else than a separator.
  bool next(std::vector<std::string>& fields);
  /// Line at which the last row begins, from 1.
  std::size_t line() const { return row_line_; }
  /// The file and that line, for messages.
  std::string place() const { return name_ + ":" + std::to_string(row_line_); }

 private:
  std::string quoted_field();

  std::string name_;
  std::string_view text_;
  char separator_;
  std::size_t at_ = 0, line_ = 1, row_line_ = 0;
};

}  // namespace subvol::cli
