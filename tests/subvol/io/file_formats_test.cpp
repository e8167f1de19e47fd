// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/file_formats.h"

#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/export/nodal_export.h"
#include "subvol/export/surface_writer.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/surface_io.h"
#include "tests/support/data.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <set>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;
using Catch::Contains;

TEST_CASE("file_formats: the docs have the tables that the program prints", "[io][docs]") {
  const std::string page = read_file(std::filesystem::path(source_dir()) / "docs" / "file-formats.md");
  CHECK_THAT(page, Contains(cell_formats_table()));
  CHECK_THAT(page, Contains(surface_formats_table()));
}

TEST_CASE("file_formats: every format that is said to be read has a reader, and no other", "[io]") {
  const TemporaryFolder folder;
  std::set<std::string_view> seen;
  for (const FileFormat& format : file_formats()) {
    CAPTURE(format.extension);
    CHECK(seen.insert(format.extension).second);
    CHECK(format_of_extension(format.extension) == &format);
    CHECK((format.read.empty() || format.written.empty() || !format.name.empty()));
    const auto path = folder.file("a" + std::string(format.extension), "nothing");
    std::string said;
    try {
      if (format.holds_cells)
        read_cells(path);
      else
        read_polygon_mesh(path);
    } catch (const InputError& error) {
      said = error.what();
    }
    CHECK_FALSE(said.empty());
    CHECK((said.find(" extension") != std::string::npos) == format.read.empty());
  }
  CHECK(format_of_extension(".MSH") == format_of_path("a/b.msh"));
  CHECK(format_of_extension(".nothing") == nullptr);
}

TEST_CASE("file_formats: an extension that is not read is told with what to do", "[io]") {
  CHECK(unknown_extension("a/b.what") == "unknown extension '.what'");
  CHECK(unknown_extension("a/b") == "unknown extension ''");
  CHECK_THAT(unknown_extension("a.b/c.USDA"), Contains("written, not read"));
  CHECK_THAT(unknown_extension("a.STEP"), Contains("unknown extension '.STEP'") && Contains("export an STL"));
  CHECK_THAT(unknown_extension("a.stl.gz"), Contains("unpack it"));
  CHECK_THAT(unknown_extension("a.blend"), Contains("another program"));
  CHECK_THAT(unknown_extension("a.med"), Contains("convert it"));
  CHECK(readable_formats(true).starts_with(".mesh .vtk .vtu "));
  CHECK(readable_formats(false).starts_with(".off .obj "));
}

TEST_CASE("file_formats: writers are those that the list names", "[io]") {
  const std::set<std::string_view> elsewhere{".mesh", ".vtk", ".vtu", ".msh", ".obj", ".glb", ".gltf", ".usda"};
  for (const FileFormat& format : file_formats()) {
    CAPTURE(format.extension);
    const std::string extension(format.extension);
    const bool is_known = is_nodal_output(extension) || is_surface_output(extension) || elsewhere.contains(extension);
    CHECK(is_known == !format.written.empty());
  }
}
