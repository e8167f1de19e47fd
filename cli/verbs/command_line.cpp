// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/verbs/command_line.h"

#include "cli/runs/exit_status.h"
#include "cli/runs/report.h"
#include "cli/verbs/commands.h"
#include "subvol/base/error.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace subvol::cli {
namespace {

/// Number of characters to insert, drop or replace to turn one word into the other.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row[b.size()];
}

/// Finds the word that a mistyped word stands for: the one that differs least from it, if it differs little.
class NearestWord {
 public:
  explicit NearestWord(std::string_view meant) : meant_(meant) {}
  void consider(const std::string& word) {
    if (const std::size_t edits = edit_distance(meant_, word); edits < least_) least_ = edits, nearest_ = word;
  }
  /// Returns a question that names the word that was found, or `otherwise` if none was.
  std::string hint(const std::string& otherwise) const {
    return nearest_.empty() ? otherwise : "did you mean " + nearest_ + "?";
  }

 private:
  std::string_view meant_;
  std::string nearest_;
  std::size_t least_ = 3;  // edits: more is another word
};

/// Refuses an unknown verb, of the program or of a group of verbs: the parser would only say that a verb is missing.
void require_known_verb(const CLI::App& app, int argc, char** argv) {
  const CLI::App* group = &app;
  std::string groups;  // the words before, each with a space
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const std::vector<const CLI::App*> verbs = group->get_subcommands({});
    if (verbs.empty() || group->get_require_subcommand_min() == 0 || word.starts_with('-') ||
        (i == 1 && word == "help"))
      return;
    NearestWord nearest(word);
    const CLI::App* found = nullptr;
    std::string names;
    for (const CLI::App* verb : verbs) {
      if (verb->get_name() == word) found = verb;
      nearest.consider(verb->get_name());
      names += ' ' + verb->get_name();
    }
    if (!found) throw UsageError("there is no verb '" + groups + word + "'; " + nearest.hint("there are:" + names));
    group = found;
    groups += word + ' ';
  }
}

/// Refuses an option that neither the verb nor the program has. The parser would first complain about arguments that
/// are missing.
void require_known_options(const CLI::App& app, int argc, char** argv) {
  const CLI::App* verb = &app;
  std::string name = "subvol";
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word == "--") return;
    if (!word.starts_with("--")) {
      const auto parts = verb->get_subcommands([&](const CLI::App* part) { return part->get_name() == word; });
      if (parts.empty()) continue;
      verb = parts.front();
      name += ' ' + std::string(word);
      continue;
    }
    const std::string option(word.substr(0, word.find('=')));
    NearestWord nearest(option);
    bool is_known = false;
    for (const CLI::App* level = verb; level != nullptr; level = level->get_parent())
      for (const CLI::Option* known : level->get_options())
        for (const std::string& long_name : known->get_lnames()) {
          const std::string spelled = "--" + long_name;
          is_known = is_known || spelled == option;
          nearest.consider(spelled);
        }
    if (is_known) continue;
    throw UsageError(name + ": there is no option '" + option + "'; " + nearest.hint(name + " --help lists them"));
  }
}

/// `subvol help fit` is `subvol fit --help`.
std::vector<std::string> arguments_of(int argc, char** argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  if (!words.empty() && words[0] == "help") {
    words.erase(words.begin());
    words.push_back("--help");
  }
  return words;
}

/// Refuses `--report=`, which would take the next word as its value.
void require_value_behind_sign(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (word.starts_with("--") && word.find('=') == word.size() - 1)
      throw UsageError(std::string(word.substr(0, word.size() - 1)) + ": expected a value, got nothing");
  }
}

/// Refuses empty values: an unset variable of a script is not a file name, and its option would otherwise count as not
/// given.
void require_values(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options())
    for (const std::string& value : option->results())
      if (value.empty()) throw UsageError(option->get_name() + ": expected a value, got nothing");
  for (const CLI::App* verb : app.get_subcommands()) require_values(*verb);
}

}  // namespace

int run_command_line(int argc, char** argv) {
  remember_command_line(argc, argv);
  CLI::App app{"Fits volume meshes to surfaces: subdivision volumes and shells.", "subvol"};
  Action action;
  describe_program(app, action);
  require_known_verb(app, argc, argv);
  require_value_behind_sign(argc, argv);
  require_known_options(app, argc, argv);
  try {
    std::vector<std::string> words = arguments_of(argc, argv);
    std::reverse(words.begin(), words.end());  // the parser takes the last one first
    app.parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  require_values(app);
  return action();
}

}  // namespace subvol::cli
