// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/verbs/config_file.h"

#include "cli/runs/exit_status.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <sstream>
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

/// Returns the keys of a file with their values, in its order.
std::vector<CLI::ConfigItem> keys_of(const std::string& text) {
  std::istringstream input(text);
  std::vector<CLI::ConfigItem> items = CLI::ConfigTOML().from_config(input);
  std::erase_if(items, [](const CLI::ConfigItem& item) { return item.name == "++" || item.name == "--"; });
  return items;
}

/// Returns the line, from 1, of the key of a number. The parser does not tell it: it is the first line up to which the
/// file has so many keys.
std::size_t line_of_key(const std::string& text, std::size_t number) {
  std::vector<std::size_t> ends;  // of the lines
  for (std::size_t end = text.find('\n'); end != text.npos; end = text.find('\n', end + 1)) ends.push_back(end);
  const auto line = std::partition_point(
      ends.begin(), ends.end(), [&](std::size_t end) { return keys_of(text.substr(0, end)).size() <= number; });
  return static_cast<std::size_t>(line - ends.begin()) + 1;
}

/// Returns what is wrong with a key, given with the verb that it is for; empty: nothing.
std::string fault_of(const CLI::App& app, const CLI::ConfigItem& item) {
  const CLI::App* verb = &app;
  std::string name;
  for (const std::string& parent : item.parents) {
    const auto found = verb->get_subcommands([&](const CLI::App* sub) { return sub->get_name() == parent; });
    if (found.empty()) return "there is no verb '" + name + parent + "'";
    verb = found.front();
    name += parent + " ";
  }
  name.pop_back();
  if (verb->get_option_no_throw("--" + item.name)) return {};
  std::string fault = name + " has no option '" + item.name + "'";
  if (const auto below = verb->get_subcommands({}); !below.empty())
    fault += ": expected a table of a verb below, such as [" + name + "." + below.front()->get_name() + "]";
  return fault;
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
  for (auto verbs = app_.get_subcommands(); !verbs.empty(); verbs = verbs.front()->get_subcommands())
    path.push_back(verbs.front()->get_name());
  if (path.empty()) return {};  // the parser is about to ask for a verb
  pass_byte_order_mark(input);
  const std::string text{std::istreambuf_iterator<char>(input), {}};
  std::vector<CLI::ConfigItem> kept;
  const std::vector<CLI::ConfigItem> keys = keys_of(text);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    CLI::ConfigItem item = keys[i];
    if (item.parents.empty()) item.parents = path;
    std::string fault = fault_of(app_, item);
    if (fault.empty() && item.parents != path) continue;  // of another verb
    if (fault.empty() && std::ranges::find(kept, item.name, &CLI::ConfigItem::name) != kept.end())
      fault = "'" + item.name + "' stands there a second time";
    if (!fault.empty())
      throw UsageError(app_.get_config_ptr()->results().back() + ":" + std::to_string(line_of_key(text, i)) + ": " +
                       fault);
    kept.push_back(std::move(item));
  }
  return kept;
}

}  // namespace subvol::cli
