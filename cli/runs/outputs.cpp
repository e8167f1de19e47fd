// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/outputs.h"

#include "cli/runs/exit_status.h"
#include "subvol/base/atomic_file.h"
#include "subvol/base/error.h"
#include "subvol/export/viewer_page.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <iostream>
#include <set>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>

#include <stdlib.h>
#include <unistd.h>

namespace subvol::cli {

using namespace internal;
namespace {

namespace fs = std::filesystem;

/// Prefix of each Part; in -o it stands before the file, separated by a colon.
constexpr std::array<std::string_view, 6> kPartNames{"", "cage", "cutaway", "animation", "boundary", "region"};
/// Splits a text into the part that it starts with and the file. UsageError: a word and a colon that name no part.
std::pair<Part, std::string> part_and_file(const std::string& text) {
  const std::size_t colon = text.find(':');
  const std::string name = text.substr(0, colon);
  const auto is_letter = [](unsigned char c) { return std::isalpha(c) != 0; };
  if (colon == std::string::npos || !std::all_of(name.begin(), name.end(), is_letter)) return {Part::result, text};
  for (std::size_t part = 1; part < kPartNames.size(); ++part)
    if (name == kPartNames[part]) return {static_cast<Part>(part), text.substr(colon + 1)};
  throw UsageError("-o " + text +
                   ": expected cage:, cutaway:, animation:, boundary: or region:NAME: before a file, not '" + name +
                   ":'; the file of that name is ./" + text);
}

/// Splits what stands behind `region:` into the name of the region and the file.
std::pair<std::string, std::string> region_and_file(const std::string& text, const std::string& rest) {
  const std::size_t colon = rest.find(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == rest.size())
    throw UsageError("-o " + text + ": expected region:NAME:FILE");
  return {rest.substr(0, colon), rest.substr(colon + 1)};
}

Output parse_output(const std::string& text) {
  Output output;
  std::string file;
  std::tie(output.part, file) = part_and_file(text);
  if (output.part == Part::region) std::tie(output.region, file) = region_and_file(text, file);
  output.path = file;
  output.extension = output.path.extension().string();
  std::transform(output.extension.begin(), output.extension.end(), output.extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (output.part == Part::animation && output.is_page()) {
    if (!has_viewer()) throw UsageError("-o " + text + ": this program was built without the viewer (docs/viewer.md)");
    return output;
  }
  const FileFormat* format = format_of_extension(output.extension);
  if (!format || format->written.empty())
    throw UsageError("-o " + text + ": " + (format ? output.extension + " is read, not written; " : "") +
                     "the extension must be one of " + output_formats());
  if ((output.part == Part::cutaway || output.part == Part::animation) && !output.is_scene())
    throw UsageError("-o " + text + ": this part is a scene; the extension must be .glb or .gltf" +
                     (output.part == Part::animation ? ", or .html for a page" : ""));
  if (output.part == Part::boundary && output.extension != ".vtu" && output.extension != ".vtk" &&
      output.extension != ".xdmf")
    throw UsageError("-o " + text + ": faces as cells; the extension must be .vtu, .vtk or .xdmf");
  return output;
}

// Creates a file to test this: for root, access() also succeeds on a read-only file system.
void require_writable_folder(const fs::path& file) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  std::string probe = (folder / ".subvol-probe-XXXXXX").string();
  const int descriptor = mkstemp(probe.data());
  if (descriptor < 0) {
    throw IoError(file.string() + ": its folder cannot be written to: " + std::strerror(errno));
  }
  close(descriptor);
  unlink(probe.c_str());
}

}  // namespace

void require_output_kind(const std::string& text) { (void)parse_output(text); }

namespace {

/// UsageError: a file that is neither a mesh nor a surface has the extension of one, as if an input were named by
/// mistake.
void refuse_model(const fs::path& file, const char* option, const char* kind) {
  if (format_of_path(file) || file.extension() == ".xyz")
    throw UsageError(std::string(option) + " " + file.string() + ": " + file.extension().string() +
                     " is an extension of models; expected a name for " + kind);
}

}  // namespace

void require_free(const fs::path& file, bool force) {
  std::error_code ignored;
  const bool exists = fs::exists(file, ignored);
  if (ignored == std::errc::filename_too_long)
    throw IoError(file.string() + ": cannot be written: " + ignored.message());
  if (fs::is_directory(file, ignored)) throw UsageError(file.string() + ": is a folder");
  if (!force && fs::is_regular_file(file, ignored)) {
    throw UsageError(file.string() + ": exists; give --force to replace it");
  }
  const fs::path target = behind_links(file);
  const bool is_open = fs::is_symlink(target, ignored);  // a link such as /proc/.../fd/N to an open file, which is
                                                         // written to directly
  if (!is_open && (!exists || fs::is_regular_file(file, ignored))) require_writable_folder(target);
}

const FileFormat& Output::format() const {
  static constexpr FileFormat page{.extension = ".html", .name = "page"};
  const FileFormat* known = format_of_extension(extension);
  return known ? *known : page;
}
bool Output::is_volume() const { return format().holds_cells; }
bool Output::is_scene() const { return format().is_scene; }

bool holds_polynomial_cells(const Output& output) {
  return output.is_volume() && output.extension != ".mesh" && output.extension != ".vtk";
}

std::string output_formats() {
  std::string list;
  for (const FileFormat& format : file_formats())
    if (!format.written.empty()) list.append(list.empty() ? "" : " ").append(format.extension);
  return list;
}

std::vector<Output> checked_outputs(const RunOptions& options, const std::vector<Part>& parts) {
  std::vector<Output> outputs;
  std::set<fs::path> seen;
  const auto claim = [&](const fs::path& path, bool force) {
    std::error_code ignored;
    fs::path file = fs::weakly_canonical(fs::absolute(behind_links(path)), ignored);
    if (file.empty()) file = fs::absolute(path).lexically_normal();
    if (!seen.insert(std::move(file)).second) {
      throw UsageError(path.string() + ": named twice as an output");
    }
    require_free(path, force);
  };
  for (const std::string& text : options.outputs) {
    outputs.push_back(parse_output(text));
    const Part part = outputs.back().part;
    if (part != Part::result && std::find(parts.begin(), parts.end(), part) == parts.end())
      throw UsageError("-o " + text + ": there is no " + std::string(kPartNames[static_cast<std::size_t>(part)]) +
                       " here");
    claim(outputs.back().path, options.force);
    std::error_code ignored;
    outputs.back().is_new = !fs::exists(outputs.back().path, ignored);
  }
  if (!options.report.empty()) {
    claim(options.report, options.force);
    refuse_model(options.report, "--report", "a report, such as report.json");
  }
  // A run that resumes from a checkpoint may continue writing to it.
  if (!options.checkpoint.empty()) {
    claim(options.checkpoint, options.force || options.checkpoint == options.resume);
    refuse_model(options.checkpoint, "--checkpoint", "a checkpoint");
    std::error_code ignored;
    if (fs::is_fifo(options.checkpoint, ignored))
      throw UsageError("--checkpoint " + options.checkpoint + ": nothing can be read again from a pipe");
  }
  return outputs;
}

std::vector<std::string> write_each(std::vector<Output>& outputs, const std::function<void(const Output&)>& write,
                                    const std::function<bool(const Output&)>& which) {
  std::vector<std::string> failures;
  const auto note = [&](const Output& output, const std::string& why) {
    const std::string name = output.path.string();
    failures.push_back(why.find(name) == std::string::npos ? name + ": " + why : why);
    std::cerr << "subvol: " << failures.back() << '\n';
  };
  std::erase_if(outputs, [&](Output& output) {
    if (which && !which(output)) return false;
    try {
      std::error_code ignored;
      if (output.is_new && fs::exists(output.path, ignored))
        throw IoError("not written: somebody else has made this file since the work began");
      write(output);
      return false;
    } catch (const IoError& error) {
      note(output, error.what());
    } catch (const InputError& error) {
      note(output, error.what());
    }
    return true;
  });
  return failures;
}

void require_all_written(const std::vector<std::string>& failures) {
  if (failures.empty()) return;
  throw IoError(std::to_string(failures.size()) + " of the outputs could not be written: " + failures.front() +
                (failures.size() > 1 ? ", ..." : ""));
}

Json warnings_json(const std::vector<std::string>& warnings, const std::vector<std::string>& failures) {
  Json json = warnings;
  for (const std::string& failure : failures) json.push_back(as_utf8(failure));
  return json;
}

Json output_names(const std::vector<Output>& outputs) {
  Json names = Json::array();
  for (const Output& output : outputs) names.push_back(as_utf8(output.path.string()));
  return names;
}

}  // namespace subvol::cli
