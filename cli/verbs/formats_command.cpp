// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/exit_status.h"
#include "cli/runs/standard_output.h"
#include "cli/verbs/commands.h"
#include "subvol/io/file_formats.h"
#include "subvol/io/nodal_mesh.h"
#include "subvol/io/surface_io.h"

namespace subvol::cli {

void add_formats_command(CLI::App& app, Action& action) {
  CLI::App* verb = app.add_subcommand("formats", "List the file formats, and what each of them holds");
  verb->footer("Columns with a slash say what is read / what is written.");
  verb->callback([&action] {
    action = [] {
      std::string text = cell_formats_table() + "\n" + surface_formats_table();
      for (const FileFormat& format : file_formats())
        if ((format.needs_netcdf && !has_exodus()) || (format.needs_cgns && !has_cgns()) ||
            (format.needs_assimp && !has_assimp()))
          text += std::string(format.extension) + ": not in this build, which has no " +
                  (format.needs_netcdf ? "netCDF\n"
                   : format.needs_cgns ? "CGNS library\n"
                                       : "Assimp\n");
      print(text);
      return static_cast<int>(kDone);
    };
  });
}

}  // namespace subvol::cli
