// SPDX-License-Identifier: GPL-3.0-or-later
// No two constants have one name and different values: CONTRIBUTING.md, "Code".

#include "tests/support/data.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace fs = std::filesystem;

namespace {

/// The values of each constant, with the file that declares it first with this value.
using Constants = std::map<std::string, std::map<std::string, std::string>>;

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }

std::string without_comments(std::string_view text) {
  std::string kept;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text.substr(i, 2) == "//") i = std::min(text.find('\n', i), text.size());
    if (i < text.size()) kept += text[i];
  }
  return kept;
}

std::string without_blanks(std::string_view text) {
  std::string kept;
  for (const char c : text)
    if (!std::isspace(static_cast<unsigned char>(c))) kept += c;
  return kept;
}

/// Returns what stands before the end of a statement: its first semicolon outside literals.
std::string_view statement(std::string_view text) {
  char quote = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quote) {
      if (c == '\\') ++i;
      if (c == quote) quote = 0;
    } else if (c == '"' || (c == '\'' && (i == 0 || !is_word(text[i - 1])))) {  // not in 100'000
      quote = c;
    } else if (c == ';') {
      return text.substr(0, i);
    }
  }
  return text;
}

/// Returns the parts of a text between commas that are in no brackets. A bracket in a literal counts as one.
std::vector<std::string_view> declarators(std::string_view text) {
  std::vector<std::string_view> parts;
  int depth = 0;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (std::string_view("([{<").find(text[i]) != std::string_view::npos) ++depth;
    if (std::string_view(")]}>").find(text[i]) != std::string_view::npos) --depth;
    if (text[i] != ',' || depth != 0) continue;
    parts.push_back(text.substr(begin, i - begin));
    begin = i + 1;
  }
  parts.push_back(text.substr(begin));
  return parts;
}

/// Returns where the first declared name of a statement begins, kSomething before '=', '{' or '['; npos: there is none,
/// because it declares a function, for example.
std::size_t first_name(std::string_view text) {
  for (std::size_t i = 1; i + 1 < text.size(); ++i) {
    if (std::string_view("(){}=").find(text[i]) != std::string_view::npos) return std::string_view::npos;
    if (text[i] != 'k' || is_word(text[i - 1]) || text[i - 1] == ':' ||
        !std::isupper(static_cast<unsigned char>(text[i + 1])))
      continue;
    std::size_t end = i;
    while (end < text.size() && is_word(text[end])) ++end;
    while (end < text.size() && std::isspace(static_cast<unsigned char>(text[end]))) ++end;
    if (end < text.size() && std::string_view("={[").find(text[end]) != std::string_view::npos) return i;
  }
  return std::string_view::npos;
}

/// Adds the constants that a file declares with `constexpr`.
void add_constants(const std::string& file, const std::string& source, Constants& constants) {
  constexpr std::string_view kKeyword = "constexpr ";
  const std::string text = without_comments(source);
  for (std::size_t at = text.find(kKeyword); at != std::string::npos; at = text.find(kKeyword, at + 1)) {
    const std::string_view declaration = statement(std::string_view(text).substr(at + kKeyword.size() - 1));
    const std::size_t first = first_name(declaration);
    if (first == std::string_view::npos) continue;
    for (const std::string_view part : declarators(declaration.substr(first))) {
      const std::string whole = without_blanks(part);
      const std::size_t end = whole.find_first_of("={[");
      if (end != std::string::npos) constants[whole.substr(0, end)].try_emplace(whole.substr(end), file);
    }
  }
}

/// Returns a line for each name that has several values.
std::vector<std::string> ambiguous_names(const Constants& constants) {
  std::vector<std::string> wrong;
  for (const auto& [name, values] : constants) {
    if (values.size() == 1) continue;
    std::string line = name;
    for (const auto& [value, file] : values) line += " " + value + " in " + file;
    wrong.push_back(line);
  }
  return wrong;
}

Constants constants_of_project() {
  Constants constants;
  const fs::path root = subvol::test::source_dir();
  for (const char* folder : {"subvol", "fit", "shell", "export", "cli", "python", "samples", "bench"})
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / folder)) {
      if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
      std::ifstream stream(entry.path());
      add_constants(entry.path().lexically_relative(root).string(), {std::istreambuf_iterator<char>(stream), {}},
                    constants);
    }
  return constants;
}

}  // namespace

TEST_CASE("A name of a constant has one value in the whole project", "[constants]") {
  const Constants constants = constants_of_project();
  CHECK(constants.size() > 1000);
  CHECK(ambiguous_names(constants) == std::vector<std::string>{});
}

TEST_CASE("The check of constants finds names with several values", "[constants]") {
  Constants constants;
  add_constants("a.h", "inline constexpr double kFar = 0.5, kNear = 1e-3;  // kSmall = 2;\nconstexpr int f(int k);",
                constants);
  add_constants("b.cpp", "static constexpr std::array<int, kCount> kTable{1, 2};\nconstexpr char kQuote = ';';",
                constants);
  CHECK(constants.size() == 4);
  CHECK(ambiguous_names(constants) == std::vector<std::string>{});
  add_constants("c.cpp", "void f() {\n  constexpr double kOther = kFar, kNear = 2e-3;\n  use(kNear);\n}", constants);
  CHECK(ambiguous_names(constants) == std::vector<std::string>{"kNear =1e-3 in a.h =2e-3 in c.cpp"});
}
