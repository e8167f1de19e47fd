// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/batch_model.h"

#include "cli/runs/exit_status.h"
#include "subvol/base/fingerprint.h"
#include "subvol/base/text_scanner.h"

namespace subvol::cli {

using namespace internal;
namespace {

constexpr std::size_t kLongestFolderName = 160;  ///< file systems allow 255 bytes; temporary names need some

}  // namespace

std::uint64_t id_hash(std::string_view id) {
  // The fingerprint's last bytes reach only a part of its bits; these steps spread them (the finalizer of SplitMix64).
  std::uint64_t hash = Fingerprint().add(id).value();
  hash = (hash ^ (hash >> 30)) * 0xbf58476d1ce4e5b9u;
  hash = (hash ^ (hash >> 27)) * 0x94d049bb133111ebu;
  return hash ^ (hash >> 31);
}

Shard parse_shard(const std::string& text) {
  const std::size_t slash = text.find('/');
  const auto number = parse_integer(std::string_view(text).substr(0, slash));
  const auto count =
      slash == std::string::npos ? std::nullopt : parse_integer(std::string_view(text).substr(slash + 1));
  constexpr std::int64_t kMostShards = 1000000;
  if (!number || !count || *count < 1 || *count > kMostShards || *number < 1 || *number > *count)
    throw UsageError("--shard: expected a number and a count as 3/8, the number from 1 to the count, not " + text);
  return {static_cast<std::uint32_t>(*number), static_cast<std::uint32_t>(*count)};
}

std::string folder_name(std::string_view id) {
  constexpr std::string_view kPlainFolderCharacters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
  constexpr std::string_view kHexadecimalDigits = "0123456789ABCDEF";
  std::string name;
  for (const char c : id) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '/')
      name += '+';
    else if (kPlainFolderCharacters.find(c) != std::string_view::npos || (c == '.' && !name.empty()))
      name += c;
    else
      (name += '=', name += kHexadecimalDigits[byte >> 4], name += kHexadecimalDigits[byte & 15]);
  }
  if (name.size() <= kLongestFolderName) return name;
  return name.substr(0, kLongestFolderName - 20) + "==" + Fingerprint().add(id).text();
}

std::string output_file(const std::string& output) {
  const std::size_t colon = output.find(':');
  return colon == std::string::npos ? "result." + output : output.substr(0, colon) + '.' + output.substr(colon + 1);
}

std::string output_word(const std::string& output) {
  const std::size_t colon = output.find(':');
  return colon == std::string::npos ? output_file(output) : output.substr(0, colon + 1) + output_file(output);
}

std::string options_hash(const BatchModel& model, std::string_view program) {
  Fingerprint hash;
  hash.add(model.verb).add(std::string_view(model.input)).add(model.options.size());
  for (const std::string& word : model.options) hash.add(std::string_view(word));
  for (const std::string& output : model.outputs) hash.add(std::string_view(output));
  return hash.add(program).text();
}

std::vector<std::string> model_words(const BatchModel& model, const BatchVerb& verb,
                                     const std::function<std::string(const std::string&)>& files) {
  std::vector<std::string> words = verb.words;
  words.push_back(files(model.input));
  for (const std::string& option : model.options) words.push_back(files(option));
  for (const std::string& output : model.outputs) {
    words.emplace_back("-o");
    words.push_back(output_word(output));
  }
  if (verb.has("--report")) words.insert(words.end(), {"--report", "report.json"});
  if (verb.has("--quiet")) words.emplace_back("--quiet");
  return words;
}

}  // namespace subvol::cli
