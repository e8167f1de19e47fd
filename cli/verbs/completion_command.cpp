// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/exit_status.h"
#include "cli/runs/standard_output.h"
#include "cli/verbs/commands.h"

#include <algorithm>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

namespace subvol::cli {
namespace {

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

std::vector<const CLI::App*> verbs_of(const CLI::App& app) {
  const auto verbs = app.get_subcommands([](const CLI::App*) { return true; });
  return {verbs.begin(), verbs.end()};
}

std::vector<std::string> names_of(const std::vector<const CLI::App*>& verbs) {
  std::vector<std::string> names;
  for (const CLI::App* verb : verbs) names.push_back(verb->get_name());
  return names;
}

std::vector<std::string> options_of(const CLI::App& verb) {
  std::vector<std::string> names;
  for (const CLI::Option* option : verb.get_options()) {
    for (const std::string& name : option->get_snames()) names.push_back('-' + name);
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

/// The words that an option accepts if its help lists them as "one|other"; otherwise none.
std::vector<std::string> words_of(const CLI::Option& option) {
  std::string text = option.get_type_name();
  text.erase(std::min(text.find(':'), text.size()));  // the part that a validator adds
  const bool is_list = text.find('|') != std::string::npos && std::all_of(text.begin(), text.end(), [](char c) {
                         return (c >= 'a' && c <= 'z') || c == '|' || c == '_' || c == '-';
                       });
  std::vector<std::string> words;
  std::istringstream stream(is_list ? text : "");
  for (std::string word; std::getline(stream, word, '|');) words.push_back(word);
  return words;
}

/// Appends the lines of a case, for a pattern of the shell, that offer what a verb accepts: its options, the words of
/// some, and the verbs below it.
void append_case(std::ostream& out, const CLI::App& verb, const std::string& pattern) {
  out << "    " << pattern << ")\n      options='" << joined(options_of(verb)) << "'\n      case \"$before\" in\n";
  for (const CLI::Option* option : verb.get_options())
    if (const auto words = words_of(*option); !words.empty())
      out << "        --" << option->get_lnames().front() << ") words='" << joined(words) << "' ;;\n";
  out << "      esac ;;\n";
}

/// A completion script for bash; zsh runs it as well.
std::string bash_completion(const CLI::App& app) {
  std::ostringstream out;
  out << "_subvol() {\n"
         "  local word=\"${COMP_WORDS[COMP_CWORD]}\" before=\"${COMP_WORDS[COMP_CWORD-1]}\"\n"
         "  local options= words= verbs= verb\n"
         "  verb=\"${COMP_WORDS[1]}\"\n"
         "  COMPREPLY=()\n"
         "  case \"$COMP_CWORD $verb\" in\n"
         "    '1 '*) verbs='"
      << joined(names_of(verbs_of(app))) << "'; options='" << joined(options_of(app)) << "' ;;\n";
  for (const CLI::App* verb : verbs_of(app))
    if (const auto below = verbs_of(*verb); !below.empty())
      out << "    '2 " << verb->get_name() << "') verbs='" << joined(names_of(below)) << "' ;;\n"
          << "    *' " << verb->get_name() << "') verb=\"$verb ${COMP_WORDS[2]}\" ;;\n";
  out << "  esac\n"
         "  case \"$verb\" in\n";
  for (const CLI::App* verb : verbs_of(app)) {
    const std::string name = '\'' + verb->get_name() + '\'';
    for (const CLI::App* below : verbs_of(*verb))
      append_case(out, *below, '\'' + verb->get_name() + ' ' + below->get_name() + '\'');
    // The word behind the name of a group may also be an argument of the group itself, as of batch.
    append_case(out, *verb, verbs_of(*verb).empty() ? name : name + " | '" + verb->get_name() + " '*");
  }
  out << "  esac\n"
         "  if [ -n \"$words$verbs\" ] && [ \"${word#-}\" = \"$word\" ]; then\n"
         "    COMPREPLY=($(compgen -W \"$words$verbs\" -- \"$word\"))\n"
         "  elif [ \"${word#-}\" != \"$word\" ]; then\n"
         "    COMPREPLY=($(compgen -W \"$options\" -- \"$word\"))\n"
         "  fi\n"
         "}\n"
         "complete -o default -F _subvol subvol\n";
  return out.str();
}

std::string fish_completion(const CLI::App& app) {
  std::ostringstream out;
  const auto one_of = [](const std::string& name) { return " -n '__fish_seen_subcommand_from " + name + "'"; };
  const auto append = [&](const CLI::App& verb, const std::string& condition) {
    for (const CLI::Option* option : verb.get_options()) {
      if (option->get_lnames().empty()) continue;
      out << "complete -c subvol" << condition << " -l " << option->get_lnames().front();
      for (const std::string& name : option->get_snames()) out << " -s " << name;
      if (option->get_expected_min() > 0) out << " -r";
      if (const auto words = words_of(*option); !words.empty()) out << " -f -a '" << joined(words) << "'";
      out << '\n';
    }
  };
  out << "complete -c subvol -n __fish_use_subcommand -f -a '" << joined(names_of(verbs_of(app))) << "'\n";
  for (const CLI::App* verb : verbs_of(app)) {
    append(*verb, one_of(verb->get_name()));
    const auto below = verbs_of(*verb);
    if (below.empty()) continue;
    out << "complete -c subvol" << one_of(verb->get_name()) << " -f -a '" << joined(names_of(below)) << "'\n";
    for (const CLI::App* one : below) append(*one, one_of(one->get_name()));
  }
  return out.str();
}

}  // namespace

void add_completion_command(CLI::App& app, Action& action) {
  CLI::App* verb = app.add_subcommand("completion", "Print what a shell needs to complete commands");
  const auto shell = std::make_shared<std::string>();
  verb->add_option("SHELL", *shell, "bash, zsh or fish")->required()->check(CLI::IsMember({"bash", "zsh", "fish"}));
  verb->footer(R"(Examples:
  source <(subvol completion bash)                                     in ~/.bashrc, or ~/.zshrc with zsh
  subvol completion fish > ~/.config/fish/completions/subvol.fish)");
  verb->callback([shell, &app, &action] {
    action = [shell, &app] {
      if (*shell == "zsh") print("autoload -U +X bashcompinit && bashcompinit\n");
      print(*shell == "fish" ? fish_completion(app) : bash_completion(app));
      return kDone;
    };
  });
}

}  // namespace subvol::cli
