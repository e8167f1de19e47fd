// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace subvol {

/// The whole content of a file. InputError: it is not there, no regular file (a folder, device, pipe), or unreadable.
std::string read_file(const std::filesystem::path& path);

/// Words and numbers of a text file held in memory, one after the other, with the line for complaints.
///
/// Words are separated by blanks, tabs and line ends. Lines end with LF, CR LF or CR; where the first line of a file
/// ends with CR alone, a LF behind a CR ends a line of its own, because it may be the first byte of binary data. A word
/// that starts with '#' opens a comment up to the end of the line, unless comments are off. Nothing is allocated by
/// what a file claims: check counts with `count`.
class TextScanner {
 public:
  enum class Comments { hash, none };
  /// name: how the file is called in messages; bytes must outlive the scanner. InputError: the text is UTF-16.
  TextScanner(std::string name, std::string_view bytes, Comments comments = Comments::hash);

  /// Called with the text of every comment that is passed, without '#' and line end.
  std::function<void(std::string_view)> on_comment;

  /// The next word, or nothing at the end of the file.
  std::optional<std::string_view> next();
  /// The next word without taking it.
  std::optional<std::string_view> peek();
  /// The next word; at the end of the file an error that names what was expected.
  std::string_view word(const char* expected);
  /// The next word as a finite number.
  double number(const char* expected);
  /// The next word as a whole number of 64 bits.
  std::int64_t integer(const char* expected);
  /// The next word as a number of entries of at least `words_per_entry` words each. Refused when negative, beyond 2^31
  /// - 1, or when the bytes left cannot hold so many.
  std::size_t count(const char* expected, std::size_t words_per_entry);

  /// The rest of the current line without its end; moves to the next. Nothing at the end of the file.
  std::optional<std::string_view> line();
  /// n bytes from here on, as they are; at least so many must be left, or an error that names what was expected.
  std::string_view bytes(std::size_t n, const char* expected);

  std::size_t bytes_left() const { return bytes_.size() - at_; }
  /// Line of the last word, comment or line.
  std::size_t word_line() const { return word_line_; }
  /// "name:line: message" as an InputError; the line is that of the last word, or the one given.
  [[noreturn]] void fail(const std::string& message) const { fail(message, word_line_); }
  [[noreturn]] void fail(const std::string& message, std::size_t line) const;

 private:
  void skip_blanks();
  /// Where the current line ends: before its LF, CR LF or CR, or at the end of the file.
  std::size_t line_end();
  /// Behind the line end at `end`.
  std::size_t behind(std::size_t end) const;

  std::string name_;
  std::string_view bytes_;
  Comments comments_;
  std::size_t at_ = 0, line_ = 1, word_line_ = 1;
  std::size_t next_lf_ = 0;  ///< the first LF from here on, if it is not before here
  bool cr_alone_ = false;    ///< the first line ends so
};

/// InputError, naming the file, where its bytes are text in UTF-16 (of either byte order, with or without a byte order
/// mark), in which no format here is written.
void require_no_utf16(const std::string& name, std::string_view bytes);

/// A word as a finite number or whole number, or nothing if it is not entirely one ("nan" and "inf" are none).
std::optional<double> parse_number(std::string_view word);
std::optional<std::int64_t> parse_integer(std::string_view word);

/// A word from a file, in quotes, shortened, without control characters: fit for a message.
std::string in_quotes(std::string_view word);

/// ASCII letters in lower case.
std::string lower_case(std::string_view text);

/// Appends the shortest text that reads back as the same double.
void append_number(std::string& text, double value);

}  // namespace subvol
