// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/tuning/tuned_numbers.h"
#include "tests/support/data.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <string>
#include <utility>
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
Strings wrong_constants(const std::string& page, std::size_t& count) {
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

using Numbers = std::map<std::string, double>;

/// Returns the tuned numbers of one part, such as "fitting", without the part's name.
Numbers numbers_of(const std::string& part) {
  Numbers numbers;
  for (const subvol::TunedNumber& number : subvol::tuned_numbers({}))
    if (number.name.starts_with(part + ".")) numbers[number.name.substr(part.size() + 1)] = number.value;
  return numbers;
}

/// Returns what is wrong with the rows "| number | values | names |" of a page: names of other numbers than these,
/// other values, and numbers that no row names.
Strings wrong_numbers(const std::string& page, Numbers numbers) {
  Strings wrong;
  bool is_table = false;
  for (const std::string& line : parts_of(page, '\n')) {
    const Strings cells = parts_of(line, '|');
    if (cells.size() != 5) is_table = false;
    if (is_table && !cells[1].starts_with("---")) {
      const Strings values = parts_of(cells[2], ','), names = parts_of(cells[3], ',');
      for (std::size_t i = 0; i < names.size(); ++i) {
        const auto found = numbers.find(names[i]);
        if (found == numbers.end() || values.size() != names.size() || found->second != value_of(values[i]))
          wrong.push_back(cells[1] + ": " + names[i]);
        if (found != numbers.end()) numbers.erase(found);
      }
    }
    if (cells.size() == 5 && cells[1] == "number" && cells[2] == "value" && cells[3] == "name") is_table = true;
  }
  for (const auto& [name, value] : numbers) wrong.push_back("missing: " + name);
  return wrong;
}

}  // namespace

TEST_CASE("The numbers that the docs name are those of the code", "[docs]") {
  std::size_t count = 0;
  for (const auto& [page, part] : {std::pair("fitting.md", "fitting"), std::pair("curved-elements.md", "curved"),
                                   std::pair("quality.md", "quality"), std::pair("automatic-fits.md", "automatic"),
                                   std::pair("optimize.md", "optimize")}) {
    INFO(page);
    const std::string text = text_of(fs::path("docs") / page);
    CHECK(wrong_numbers(text, numbers_of(part)) == Strings{});
    CHECK(wrong_constants(text, count) == Strings{});
  }
  CHECK(count > 8);
}

TEST_CASE("The check of the tuned numbers in the docs reports what is wrong", "[docs]") {
  const std::string head = "| number | value | name |\n|---|---|---|\n";
  const Numbers numbers{{"a", 0.5}, {"b", 3}};
  CHECK(wrong_numbers(head + "| right | 1/2, 3 | `a`, `b` |\n", numbers) == Strings{});
  CHECK(wrong_numbers(head + "| value | 0.5, 4 | `a`, `b` |\n", numbers) == Strings{"value: b"});
  CHECK(wrong_numbers(head + "| count | 0.5 | `a`, `b` |\n", numbers) == Strings{"count: a", "count: b"});
  CHECK(wrong_numbers(head + "| name | 0.5, 3 | `a`, `c` |\n", numbers) == Strings{"name: c", "missing: b"});
  CHECK(wrong_numbers("| other | value | name |\n| row | 0.5, 3 | `a`, `b` |\n", numbers).size() == 2);
}

TEST_CASE("The check of the constants in the docs reports what is wrong", "[docs]") {
  std::size_t count = 0;
  const std::string file = "| `fit/automatic_fit.h` |\n";
  CHECK(wrong_constants("| right | 1/5, 0.02 | `kLostFeaturePercent`, `kAutomaticMeanPercent` " + file, count) ==
        Strings{});
  CHECK(count == 2);
  CHECK(wrong_constants("| value | 0.02 | `kAutomaticMaxPercent` " + file, count) ==
        Strings{"value: kAutomaticMaxPercent"});
  CHECK(wrong_constants("| name | 0.02 | `kAutomaticLeast` " + file, count) == Strings{"name: kAutomaticLeast"});
  CHECK(wrong_constants("| number | 0.02 | `kAutomaticMeanPercent`, `kFarOffFactor` " + file, count).size() == 2);
  CHECK(wrong_constants("| file | 0.02 | `kAutomaticMeanPercent` | `fit/none.h` |\n", count) ==
        Strings{"file: kAutomaticMeanPercent"});
}
