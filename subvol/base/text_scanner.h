// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace subvol::internal {

/// Returns the whole content of a file. InputError: the file does not exist, is not a regular file (but a folder,
/// device or pipe), cannot be read, or is a pointer of Git LFS.
std::string read_file(const std::filesystem::path& path);

/// Returns a text without the blanks, tabs and carriage returns at its ends.
std::string trimmed(std::string_view text);

/// Reads the words and numbers of a text file in memory, one after the other, and knows their lines for messages.
///
/// Words are separated by blanks, tabs and line ends. Lines end with LF, CR LF or CR; if the first line of a file ends
/// with CR alone, an LF after a CR ends a line of its own, because it may be the first byte of binary data. A word that
/// starts with '#' opens a comment up to the end of the line, unless comments are off. A file may claim any count:
/// read counts with `count` before allocating memory for them.
class TextScanner {
 public:
  enum class Comments { hash, none };
  /// name: the file's name for messages; bytes must outlive the scanner. InputError: as `require_no_utf16`.
  TextScanner(std::string name, std::string_view bytes, Comments comments = Comments::hash);

  /// Called with the text of every comment that is skipped, without its '#' and line end.
  std::function<void(std::string_view)> on_comment;

  /// Takes and returns the next word, or returns nothing at the end of the file.
  std::optional<std::string_view> next();
  /// Returns the next word without taking it.
  std::optional<std::string_view> peek();
  /// Takes the next word. InputError at the end of the file, naming what was expected.
  std::string_view word(const char* expected);
  /// Takes the next word as a finite number.
  double number(const char* expected);
  /// Takes the next word as a whole number of 64 bits.
  std::int64_t integer(const char* expected);
  /// Takes the next word as a number of entries of at least `words_per_entry` words each. InputError: the number is
  /// negative, exceeds 2^31 - 1, or the bytes left cannot hold so many entries.
  std::size_t count(const char* expected, std::size_t words_per_entry);

  /// Returns the rest of the current line without its end and moves to the next line; nothing at the end of the file.
  std::optional<std::string_view> line();
  /// Takes the next n bytes as they are. InputError, naming what was expected, if fewer are left.
  std::string_view bytes(std::size_t n, const char* expected);

  std::size_t bytes_left() const { return bytes_.size() - at_; }
  /// Line of the last word, comment or line, counted from 1.
  std::size_t word_line() const { return word_line_; }
  /// Throws InputError("name:line: message"); the line is that of the last word, or the one given.
  [[noreturn]] void fail(const std::string& message) const { fail(message, word_line_); }
  [[noreturn]] void fail(const std::string& message, std::size_t line) const;

 private:
  void skip_blanks();
  /// Returns the end of the current line: the place of its LF, CR LF or CR, or the end of the file.
  std::size_t line_end();
  /// Returns the place after the line end at `end`.
  std::size_t behind(std::size_t end) const;

  std::string name_;
  std::string_view bytes_;
  Comments comments_;
  std::size_t at_ = 0, line_ = 1, word_line_ = 1;
  std::size_t next_lf_ = 0;  ///< place of the first LF from at_ on; out of date if it is before at_
  bool cr_alone_ = false;    ///< true if the first line ends with CR alone
};

/// Throws InputError, naming the file, if its bytes begin with ASCII characters in UTF-16 (in either byte order, with
/// or without a byte order mark). No format here is written in UTF-16.
void require_no_utf16(const std::string& name, std::string_view bytes);

/// Return a word as a finite number or as a whole number, or nothing if not all of it is one ("nan" and "inf" are not).
std::optional<double> parse_number(std::string_view word);
std::optional<std::int64_t> parse_integer(std::string_view word);

/// Returns a word from a file for a message: in quotes, at most 40 characters, '?' for all but printable ASCII.
std::string in_quotes(std::string_view word);

/// Return the text with its ASCII letters in lower case, or in upper case.
std::string lower_case(std::string_view text);
std::string upper_case(std::string_view text);

/// Appends the shortest text that reads back as the same double.
void append_number(std::string& text, double value);

}  // namespace subvol::internal
