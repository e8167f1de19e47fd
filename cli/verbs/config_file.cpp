// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/verbs/config_file.h"

#include "cli/runs/exit_status.h"

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

namespace subvol::cli {

namespace {

/// Skips a byte order mark: some editors begin a file with one.
void pass_byte_order_mark(std::istream& input) {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  const std::istream::pos_type begin = input.tellg();
  std::array<char, kMark.size()> first{};
  input.read(first.data(), first.size());
  if (input && std::string_view(first.data(), first.size()) == kMark) return;
  input.clear();
  input.seekg(begin);
}

}  // namespace

CLI::Validator regular_file() {
  const auto check = [](const std::string& name) -> std::string {
    std::error_code ignored;
    if (!std::filesystem::exists(name, ignored) || std::filesystem::is_regular_file(name, ignored)) return {};
    return name + ": expected a file, not a folder, a device or a pipe";
  };
  return CLI::Validator(check, "");
}

std::vector<CLI::ConfigItem> VerbConfig::from_config(std::istream& input) const {
  std::vector<std::string> path;  // the verb, and the verb below it if it is a group
  const CLI::App* verb = &app_;
  for (auto verbs = app_.get_subcommands(); !verbs.empty(); verbs = verbs.front()->get_subcommands()) {
    verb = verbs.front();
    path.push_back(verb->get_name());
  }
  if (path.empty()) return {};  // the parser is about to ask for a verb
  pass_byte_order_mark(input);
  const auto names_a_verb = [&](const std::string& name) {
    return !app_.get_subcommands([&](const CLI::App* sub) { return sub->get_name() == name; }).empty();
  };
  std::vector<CLI::ConfigItem> kept;
  for (CLI::ConfigItem& item : CLI::ConfigTOML::from_config(input)) {
    if (item.name == "++" || item.name == "--") continue;
    if (item.parents.empty()) item.parents = path;
    if ((path.empty() || item.parents.front() != path.front()) && names_a_verb(item.parents.front())) continue;
    if (item.parents == path && !verb->get_option_no_throw("--" + item.name))
      throw UsageError("--config: " + verb->get_name() + " has no option '" + item.name + "'");
    kept.push_back(std::move(item));
  }
  return kept;
}

}  // namespace subvol::cli
