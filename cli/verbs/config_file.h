// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <CLI/CLI.hpp>

#include <istream>
#include <vector>

namespace subvol::cli {

/// Accepts anything but devices and pipes, which may have no end; missing files are refused elsewhere.
CLI::Validator regular_file();

/// Reads --config files: keys are the long options of the current verb, without a section or in one named after the
/// verb.
///
/// Sections of other verbs are skipped, so that one file can serve several. The command line overrides the file.
/// UsageError, with the file, the line and the key: a key that its verb does not have, also in the section of another
/// verb; a section of no verb; a key that stands in two places.
class VerbConfig : public CLI::ConfigTOML {
 public:
  explicit VerbConfig(const CLI::App& app) : app_(app) {}
  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;

 private:
  const CLI::App& app_;
};

}  // namespace subvol::cli
