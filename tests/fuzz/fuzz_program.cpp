// SPDX-License-Identifier: GPL-3.0-or-later
// libFuzzer target of what only the program reads: kExtension says of which files. Reports (.json) become pages
// or are refused, options from a file (.toml) are understood or a usage error, thicknesses (.txt) are positive numbers.

#include "cli/runs/exit_status.h"
#include "cli/runs/loading.h"
#include "cli/runs/report_page.h"
#include "cli/verbs/commands.h"
#include "subvol/base/error.h"
#include "tests/fuzz/bytes_as_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

using namespace subvol::cli;
using subvol::fuzz::kExtension;
using subvol::fuzz::require;

namespace {

void show_report(std::string_view bytes) {
  try {
    const Json report = parse_report(bytes, "report.json");
    std::vector<std::string> notes;
    const ReportMeshes meshes = load_report_meshes(report, "/no/such/folder", notes);
    const std::vector<ReportPicture> pictures = report_pictures(report, meshes, notes);
    require(report_page(report, {}, pictures, notes).ends_with("</html>\n"));
  } catch (const Json::exception&) {
  }
}

/// As if the file were given to one verb after the other.
void take_options(const std::string& file) {
  const std::array<std::vector<std::string>, 3> lines{{{"fit", "target.off", "-o", "out.mesh"},
                                                       {"optimize", "cells.mesh", "-o", "out.mesh"},
                                                       {"shell", "surface.off", "--thickness", "1", "-o", "out.mesh"}}};
  for (std::vector<std::string> words : lines) {
    CLI::App app("", "subvol");
    Action action;
    describe_program(app, action);
    words.insert(words.end(), {"--config", file});
    std::reverse(words.begin(), words.end());  // as the parser wants them
    try {
      app.parse(std::move(words));
      require(bool(action));
    } catch (const CLI::ParseError& error) {
      std::ostringstream told;
      app.exit(error, told, told);
    } catch (const UsageError&) {
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    if (kExtension == ".json") show_report({reinterpret_cast<const char*>(data), size});
    if (kExtension == ".toml") take_options(subvol::fuzz::as_file(data, size).string());
    if (kExtension == ".txt")
      for (const double thickness : load_thicknesses(subvol::fuzz::as_file(data, size)))
        require(thickness > 0 && std::isfinite(thickness));
  } catch (const subvol::InputError& error) {
    require(std::string_view(error.what()).size() > 3);
  }
  return 0;
}
