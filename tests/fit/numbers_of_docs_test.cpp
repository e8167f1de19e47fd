// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/data.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>
#include <vector>

namespace fs = std::filesystem;

namespace {

using Strings = std::vector<std::string>;

std::string text_of(const fs::path& file) {
  std::ifstream stream(fs::path(subvol::test::source_dir()) / file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Returns the parts of a text between separators, without blanks and backquotes around them.
Strings parts_of(const std::string& text, char separator) {
  Strings parts;
  std::string part;
  const auto add = [&] {
    const auto first = part.find_first_not_of(" `"), last = part.find_last_not_of(" `");
    parts.push_back(first == std::string::npos ? "" : part.substr(first, last - first + 1));
    part.clear();
  };
  for (const char c : text) c == separator ? add() : part.push_back(c);
  add();
  return parts;
}

/// Returns the value of a number or of a quotient of two, such as "20'000" or "1.0 / 16".
double value_of(std::string text) {
  std::erase(text, '\'');
  const auto slash = text.find('/');
  return slash == std::string::npos ? std::stod(text) : std::stod(text) / std::stod(text.substr(slash + 1));
}

/// Returns true if a source declares a constant with this value.
bool declares(const std::string& source, const std::string& name, double value) {
  const std::regex declaration("\\b" + name + " = ([0-9.e'/ -]+)[,;]");
  return std::any_of(std::sregex_iterator(source.begin(), source.end(), declaration), std::sregex_iterator(),
                     [&](const std::smatch& match) { return value_of(match[1]) == value; });
}

/// Returns what is wrong with the rows "| number | values | constants | file |" of a page, and counts its constants.
Strings wrong_rows(const std::string& page, std::size_t& count) {
  Strings wrong;
  for (const std::string& line : parts_of(page, '\n')) {
    const Strings cells = parts_of(line, '|');
    if (cells.size() != 6 || !cells[3].starts_with('k') || !cells[4].starts_with("fit/")) continue;
    const Strings values = parts_of(cells[2], ','), names = parts_of(cells[3], ',');
    const std::string source = text_of(cells[4]);
    for (std::size_t i = 0; i < names.size(); ++i, ++count)
      if (values.size() != names.size() || !declares(source, names[i], value_of(values[i])))
        wrong.push_back(cells[1] + ": " + names[i]);
  }
  return wrong;
}

}  // namespace

TEST_CASE("The numbers that the docs name are those of the code", "[docs]") {
  std::size_t count = 0;
  for (const char* page : {"fitting.md", "curved-elements.md", "quality.md", "automatic-fits.md", "optimize.md"}) {
    INFO(page);
    CHECK(wrong_rows(text_of(fs::path("docs") / page), count) == Strings{});
  }
  CHECK(count > 100);
}

TEST_CASE("The check of the numbers in the docs reports what is wrong", "[docs]") {
  std::size_t count = 0;
  const std::string file = "| `fit/fits/fit_schedule.h` |\n";
  CHECK(wrong_rows("| right | 1/16, 0.001 | `kLeastDefaultLambdaShare`, `kLeastLambdaShare` " + file, count) ==
        Strings{});
  CHECK(count == 2);
  CHECK(wrong_rows("| value | 0.02 | `kLeastLambdaHalvingGain` " + file, count) ==
        Strings{"value: kLeastLambdaHalvingGain"});
  CHECK(wrong_rows("| name | 0.01 | `kLeastLoss` " + file, count) == Strings{"name: kLeastLoss"});
  CHECK(wrong_rows("| number | 0.01 | `kLeastLambdaHalvingGain`, `kMostUnfoldingLambda` " + file, count).size() == 2);
  CHECK(wrong_rows("| file | 0.01 | `kLeastLambdaHalvingGain` | `fit/none.h` |\n", count) ==
        Strings{"file: kLeastLambdaHalvingGain"});
}
