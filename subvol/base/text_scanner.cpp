// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/text_scanner.h"

#include "subvol/base/error.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

namespace subvol::internal {

namespace {

bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

template <class Number>
std::optional<Number> parse(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  Number value;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

constexpr std::size_t kNotFound = std::string_view::npos;

/// Returns true if the first kProbedWideUnits units of two bytes (or all of them, if there are fewer but at least one)
/// are printable or blank ASCII. zero: which byte of a unit must be 0; 0 for big-endian, 1 for little-endian.
bool has_wide_ascii(std::string_view bytes, std::size_t zero) {
  constexpr std::size_t kProbedWideUnits = 4;  // more than a binary file has of such bytes by chance
  if (bytes.size() < 2) return false;
  for (std::size_t i = 0; i < std::min(bytes.size() / 2, kProbedWideUnits); ++i) {
    const char c = bytes[2 * i + 1 - zero];
    if (bytes[2 * i + zero] != 0 || !(is_blank(c) || (c > ' ' && c <= '~'))) return false;
  }
  return true;
}

const char* kind_name(std::filesystem::file_status status) {
  if (std::filesystem::is_fifo(status)) return "pipe";
  return std::filesystem::is_socket(status) ? "socket" : "device";
}

}  // namespace

std::string read_file(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) throw InputError(path.string() + ": no such file");
  if (std::filesystem::is_directory(status)) throw InputError(path.string() + ": is a folder, expected a file");
  // A device may have no end, a pipe can be read only once, and some files are read twice.
  if (!std::filesystem::is_regular_file(status))
    throw InputError(path.string() + ": is a " + kind_name(status) + ", expected a file");

  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::string bytes;
  if (const auto size = std::filesystem::file_size(path, error); !error) bytes.reserve(size);
  char buffer[1 << 16];
  while (file.read(buffer, sizeof buffer) || file.gcount() > 0)
    bytes.append(buffer, static_cast<std::size_t>(file.gcount()));
  if (!file.eof()) throw InputError(path.string() + ": cannot be read: " + std::strerror(errno));
  if (bytes.starts_with("version https://git-lfs.github.com/spec/"))
    throw InputError(path.string() +
                     ": only a pointer of Git LFS to the file: get the file itself with `git lfs pull`");
  return bytes;
}

std::string trimmed(std::string_view text) {
  constexpr std::string_view kTrimmedBlanks = " \t\r";
  const std::size_t begin = text.find_first_not_of(kTrimmedBlanks);
  if (begin == std::string_view::npos) return {};
  return std::string(text.substr(begin, text.find_last_not_of(kTrimmedBlanks) + 1 - begin));
}

TextScanner::TextScanner(std::string name, std::string_view bytes, Comments comments)
    : name_(std::move(name)), bytes_(bytes), comments_(comments) {
  require_no_utf16(name_, bytes_);
  if (bytes_.starts_with("\xEF\xBB\xBF")) at_ = 3;  // a byte order mark that some editors leave
  const std::size_t first_end = line_end();
  cr_alone_ = first_end < bytes_.size() && bytes_[first_end] == '\r' && behind(first_end) == first_end + 1;
}

// The place of the next LF is kept: if lines end with CR, the LF may be far away or missing.
std::size_t TextScanner::line_end() {
  if (next_lf_ < at_ || (next_lf_ == 0 && at_ == 0)) next_lf_ = std::min(bytes_.find('\n', at_), bytes_.size());
  const std::size_t length = bytes_.substr(at_, next_lf_ - at_).find('\r');
  return length == kNotFound ? next_lf_ : at_ + length;
}

std::size_t TextScanner::behind(std::size_t end) const {
  if (end == bytes_.size()) return end;
  const bool is_pair = bytes_[end] == '\r' && !cr_alone_ && end + 1 < bytes_.size() && bytes_[end + 1] == '\n';
  return end + (is_pair ? 2 : 1);
}

void TextScanner::skip_blanks() {
  while (at_ < bytes_.size()) {
    const char c = bytes_[at_];
    if (c == '#' && comments_ == Comments::hash) {
      const std::size_t end = line_end();
      word_line_ = line_;
      if (on_comment) on_comment(bytes_.substr(at_ + 1, end - at_ - 1));
      at_ = end;
    } else if (c == '\n' || c == '\r') {
      at_ = behind(at_);
      ++line_;
    } else if (is_blank(c)) {
      ++at_;
    } else {
      return;
    }
  }
}

std::optional<std::string_view> TextScanner::peek() {
  skip_blanks();
  word_line_ = line_;
  if (at_ == bytes_.size()) return std::nullopt;
  std::size_t end = at_;
  while (end < bytes_.size() && !is_blank(bytes_[end])) ++end;
  return bytes_.substr(at_, end - at_);
}

std::optional<std::string_view> TextScanner::next() {
  const auto word = peek();
  if (word) at_ += word->size();
  return word;
}

std::string_view TextScanner::word(const char* expected) {
  const auto word = next();
  if (!word) fail(std::string("the file ends where ") + expected + " is expected");
  return *word;
}

double TextScanner::number(const char* expected) {
  const std::string_view text = word(expected);
  const auto value = parse_number(text);
  if (!value) fail(std::string("expected ") + expected + " (a finite number), found " + in_quotes(text));
  return *value;
}

std::int64_t TextScanner::integer(const char* expected) {
  const std::string_view text = word(expected);
  const auto value = parse_integer(text);
  if (!value) fail(std::string("expected ") + expected + " (a whole number), found " + in_quotes(text));
  return *value;
}

std::size_t TextScanner::count(const char* expected, std::size_t words_per_entry) {
  const std::int64_t n = integer(expected);
  if (n < 0) fail(std::string(expected) + " is negative: " + std::to_string(n));
  // A word takes at least one byte and a separator; the last word of the file needs no separator.
  const std::size_t room = (bytes_left() + 1) / 2 / std::max<std::size_t>(words_per_entry, 1);
  if (static_cast<std::uint64_t>(n) > room)
    fail(std::string(expected) + " is " + std::to_string(n) + ", more than the rest of the file can hold");
  if (n > std::numeric_limits<std::int32_t>::max()) fail(std::string(expected) + " exceeds 2^31 - 1");
  return static_cast<std::size_t>(n);
}

std::optional<std::string_view> TextScanner::line() {
  word_line_ = line_;
  if (at_ == bytes_.size()) return std::nullopt;
  const std::size_t end = line_end();
  const std::string_view text = bytes_.substr(at_, end - at_);
  at_ = behind(end);
  ++line_;
  return text;
}

std::string_view TextScanner::bytes(std::size_t n, const char* expected) {
  if (n > bytes_left()) fail(std::string("the file ends within ") + expected);
  const std::string_view text = bytes_.substr(at_, n);
  at_ += n;
  return text;
}

void TextScanner::fail(const std::string& message, std::size_t line) const {
  throw InputError(name_ + ":" + std::to_string(line) + ": " + message);
}

void require_no_utf16(const std::string& name, std::string_view bytes) {
  const bool little_mark = bytes.starts_with("\xFF\xFE"), big_mark = bytes.starts_with("\xFE\xFF");
  const std::string_view text = bytes.substr(little_mark || big_mark ? 2 : 0);
  if ((!big_mark && has_wide_ascii(text, 1)) || (!little_mark && has_wide_ascii(text, 0)))
    throw InputError(name + ": the text is UTF-16, two bytes to a character; save it as UTF-8");
}

std::optional<double> parse_number(std::string_view word) {
  const auto value = parse<double>(word);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<std::int64_t> parse_integer(std::string_view word) { return parse<std::int64_t>(word); }

std::string in_quotes(std::string_view word) {
  constexpr std::size_t kLongestQuotedWord = 40;  // characters
  std::string text = "'";
  for (const char c : word.substr(0, kLongestQuotedWord)) text += c >= ' ' && c <= '~' ? c : '?';
  return text + (word.size() > kLongestQuotedWord ? "...'" : "'");
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return lower;
}

std::string upper_case(std::string_view text) {
  std::string upper(text);
  for (char& c : upper)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return upper;
}

void append_number(std::string& text, double value) {
  char buffer[32];
  text.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}

}  // namespace subvol::internal
