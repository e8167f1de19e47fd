// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace subvol::cli {

/// One model of a batch: `subvol VERB INPUT OPTIONS`, with outputs that the batch names.
struct BatchModel {
  std::string id;                    ///< distinct within a batch
  std::string verb;                  ///< "fit", "template auto"
  std::string input;                 ///< a file, relative to the folder of its manifest
  std::vector<std::string> options;  ///< words of the command line; values that name files are relative to that folder
  std::vector<std::string> outputs;  ///< "mesh", "cage:glb": the extension, if need be behind a part
  std::uint32_t folder = 0;          ///< number of the folder in its `BatchManifest`
};

/// The models of a batch, and the folders that their files are relative to.
struct BatchManifest {
  std::vector<std::filesystem::path> folders;
  std::vector<BatchModel> models;
};

/// Properties of a verb that a batch needs.
struct BatchVerb {
  std::vector<std::string> words;              ///< {"template", "auto"}
  std::set<std::string, std::less<>> options;  ///< long names, with their hyphens
  bool has(std::string_view option) const { return options.count(option) > 0; }
};

/// Returns what is known about a verb; null if a batch cannot run it.
using VerbLookup = std::function<const BatchVerb*(const std::string& verb)>;

/// Hash of an id, well mixed in all bits. It chooses the shard, and the byte that is locked while the model runs.
std::uint64_t id_hash(std::string_view id);

/// Shard `number` (from 1) of `count`.
struct Shard {
  std::uint32_t number = 1, count = 1;
  bool holds(std::string_view id) const { return id_hash(id) % count == number - 1; }
};
/// Parses "3/8". UsageError: something else, or a number that is not in 1 .. count.
Shard parse_shard(const std::string& text);

/// Name of a model's folder: the id with '/' as '+', and with =XX (hexadecimal) for each byte that is not a letter, a
/// digit, or one of '.', '_', '-' (and for '.' at the start). Distinct ids have distinct names; ids of more than 160
/// such characters are cut and end with their hash instead.
std::string folder_name(std::string_view id);

/// File name of an output: "result.mesh" for "mesh", "cage.glb" for "cage:glb".
std::string output_file(const std::string& output);
/// The output as -o takes it: "result.mesh", "cage:cage.glb".
std::string output_word(const std::string& output);

/// Fingerprint of what a model asks for but the contents of its files: verb, names, options, outputs, and the program.
std::string options_hash(const BatchModel& model, std::string_view program);

/// The words that follow the program's name. `files` is called for the input and for each value of an option; it
/// returns the word to use.
std::vector<std::string> model_words(const BatchModel& model, const BatchVerb& verb,
                                     const std::function<std::string(const std::string&)>& files);

}  // namespace subvol::cli
