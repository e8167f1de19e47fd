// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/file_formats.h"

#include "subvol/base/text_scanner.h"

#include <algorithm>
#include <iterator>

namespace subvol {

using namespace internal;

namespace {

constexpr Held kHeldByNumber = Held::numbers, kHeldWithNames = Held::names;
constexpr std::string_view kGmshOrders = "tets 1 to 10, hexes 1 to 9, prisms 1 and 2", kQuadraticOrders = "1, 2",
                           kLagrangeOrders = "1, 2, Lagrange to 16", kTextOnly = "text",
                           kTextAndBinary = "text, binary";

FileFormat exodus(std::string_view extension, std::string_view written) {
  return {.extension = extension,
          .name = "Exodus II",
          .holds_cells = true,
          .read = "yes",
          .written = written,
          .orders_read = kQuadraticOrders,
          .orders_written = kQuadraticOrders,
          .groups_read = kHeldWithNames,
          .groups_written = kHeldWithNames,
          .regions_read = kHeldWithNames,
          .regions_written = kHeldWithNames,
          .needs_netcdf = true};
}

FileFormat nastran(std::string_view extension, std::string_view written) {
  return {.extension = extension,
          .name = "Nastran",
          .holds_cells = true,
          .read = "yes",
          .written = written,
          .orders_read = kQuadraticOrders,
          .orders_written = kQuadraticOrders,
          .groups_read = kHeldByNumber,
          .regions_read = kHeldByNumber,
          .regions_written = kHeldByNumber};
}

FileFormat gltf(std::string_view extension) {
  return {.extension = extension,
          .name = "glTF",
          .read = "2.0",
          .written = "2.0",
          .groups_read = kHeldWithNames,
          .groups_written = kHeldWithNames,
          .is_scene = true};
}

const FileFormat kFormats[] = {
    {.extension = ".mesh",
     .name = "Medit; MFEM is read, too",
     .holds_cells = true,
     .read = "1 to 4, ASCII",
     .written = "2",
     .orders_read = "1",
     .orders_written = "1",
     .groups_read = kHeldWithNames,
     .groups_written = kHeldWithNames,
     .regions_read = kHeldWithNames,
     .regions_written = kHeldWithNames,
     .holds_features = true},
    {.extension = ".vtk",
     .name = "legacy VTK",
     .holds_cells = true,
     .read = "2.0 to 5.1, ASCII, binary",
     .written = "3.0, ASCII",
     .orders_read = kLagrangeOrders,
     .orders_written = "1",
     .regions_read = kHeldByNumber,
     .regions_written = kHeldByNumber},
    {.extension = ".vtu",
     .name = "VTK XML",
     .holds_cells = true,
     .read = "0.1 to 2.2; ASCII, base64, appended, zlib, LZ4",
     .written = "1.0 linear, 2.2 curved",
     .orders_read = kLagrangeOrders,
     .orders_written = "1 to 12",
     .groups_read = kHeldWithNames,
     .groups_written = kHeldWithNames,
     .regions_read = kHeldWithNames,
     .regions_written = kHeldWithNames},
    {.extension = ".msh",
     .name = "Gmsh",
     .holds_cells = true,
     .read = "2.2, 4.0, 4.1; ASCII, binary",
     .written = "2.2 or 4.1, ASCII",
     .orders_read = kGmshOrders,
     .orders_written = kGmshOrders,
     .groups_read = kHeldWithNames,
     .groups_written = kHeldWithNames,
     .regions_read = kHeldWithNames,
     .regions_written = kHeldWithNames},
    {.extension = ".inp",
     .name = "Abaqus, CalculiX",
     .holds_cells = true,
     .read = "yes",
     .written = "yes",
     .orders_read = kQuadraticOrders,
     .orders_written = kQuadraticOrders,
     .groups_read = kHeldWithNames,
     .groups_written = kHeldWithNames,
     .regions_read = kHeldWithNames,
     .regions_written = kHeldWithNames},
    nastran(".bdf", "yes"),
    nastran(".nas", ""),
    nastran(".fem", ""),
    {.extension = ".mfem",
     .name = "MFEM",
     .holds_cells = true,
     .read = "1.0, 1.2, 1.3",
     .written = "1.0",
     .orders_read = "1 to 16",
     .orders_written = "1 to 16",
     .groups_read = kHeldByNumber,
     .groups_written = kHeldByNumber,
     .regions_read = kHeldByNumber,
     .regions_written = kHeldByNumber},
    exodus(".e", "yes"),
    exodus(".exo", "yes"),
    exodus(".ex2", ""),
    exodus(".gen", ""),
    {.extension = ".cgns",
     .name = "CGNS",
     .holds_cells = true,
     .read = "unstructured",
     .orders_read = kQuadraticOrders,
     .groups_read = kHeldWithNames,
     .regions_read = kHeldWithNames,
     .needs_cgns = true},
    {.extension = ".xdmf",
     .name = "XDMF",
     .holds_cells = true,
     .written = "3, in text",
     .orders_written = kQuadraticOrders,
     .regions_written = kHeldWithNames},
    {.extension = ".off", .name = "OFF", .read = kTextOnly, .groups_read = kHeldWithNames},
    {.extension = ".obj",
     .name = "Wavefront OBJ",
     .read = kTextOnly,
     .written = kTextOnly,
     .groups_read = kHeldWithNames,
     .groups_written = kHeldWithNames},
    {.extension = ".stl",
     .name = "STL",
     .read = kTextAndBinary,
     .written = kTextAndBinary,
     .groups_read = kHeldWithNames,
     .groups_written = kHeldWithNames},
    {.extension = ".ply",
     .name = "PLY",
     .read = "1.0, text, binary",
     .written = "1.0, binary",
     .groups_read = kHeldByNumber,
     .groups_written = kHeldByNumber},
    {.extension = ".vtp",
     .name = "VTK XML polygons",
     .read = "0.1 to 2.2",
     .written = "1.0",
     .groups_read = kHeldWithNames,
     .groups_written = kHeldWithNames},
    {.extension = ".3mf",
     .name = "3MF",
     .read = "yes",
     .written = "yes",
     .groups_read = kHeldWithNames,
     .groups_written = kHeldWithNames},
    gltf(".glb"),
    gltf(".gltf"),
    {.extension = ".fbx", .name = "FBX", .read = kTextAndBinary, .groups_read = kHeldWithNames, .needs_assimp = true},
    {.extension = ".dae", .name = "COLLADA", .read = "1.4, 1.5", .groups_read = kHeldWithNames, .needs_assimp = true},
    {.extension = ".usda",
     .name = "USD",
     .written = kTextOnly,
     .groups_written = kHeldWithNames,
     .holds_features = true},
};

/// Files of a kind that is not read.
struct ForeignFiles {
  std::string_view extensions;  ///< in lower case, with blanks between them
  std::string_view advice;      ///< what they are, and what to do with them
};

constexpr ForeignFiles kForeignFiles[] = {
    {".step .stp .iges .igs .brep .brp .sat .sab .x_t .x_b .sldprt .sldasm .ipt .iam .catpart .catproduct .prt .3dm "
     ".fcstd .f3d .dwg .dxf .jt .3dxml .scad",
     "a CAD model: export an STL or OBJ file of it"},
    {".blend .max .ma .mb .c4d .skp .lwo .3ds .x3d .wrl .xaml .usd .usdc .usdz .abc .ctm .amf",
     "a model of another program: export an STL, OBJ or glTF file of it"},
    {".zip .gz .bz2 .xz .zst .7z .rar .tar .tgz .zae", "an archive or compressed file: unpack it"},
    {".med .su2 .vol .h5m .ugrid .node .ele .neu .unv .cas",
     "a mesh of another program: convert it to .vtu or .msh, for instance with meshio or Gmsh"},
};

std::string_view said(Held held) { return held == Held::none ? "no" : held == Held::numbers ? "numbers" : "names"; }

/// What is read and what is written, in one word if that is the same.
std::string both(std::string_view read, std::string_view written) {
  return read == written ? std::string(read) : std::string(read) + " / " + std::string(written);
}

std::string or_no(std::string_view text) { return text.empty() ? "no" : std::string(text); }

void append_row(std::string& text, std::initializer_list<std::string> cells) {
  text += '|';
  for (const std::string& cell : cells) ((text += ' ') += cell) += " |";
  text += '\n';
}

std::string extension_cell(const FileFormat& format) {
  return "`" + std::string(format.extension) + "` (" + std::string(format.name) + ")";
}

}  // namespace

bool FileFormat::has_quadratic_cells_at_most() const { return orders_written == kQuadraticOrders; }

bool FileFormat::holds_all_groups_of_faces() const {
  return holds_cells && groups_written == kHeldWithNames && extension != ".mesh";
}

std::span<const FileFormat> file_formats() { return kFormats; }

const FileFormat* format_of_extension(std::string_view extension) {
  const std::string wanted = lower_case(extension);
  const auto found = std::find_if(std::begin(kFormats), std::end(kFormats),
                                  [&](const FileFormat& format) { return wanted == format.extension; });
  return found == std::end(kFormats) ? nullptr : found;
}

const FileFormat* format_of_path(const std::filesystem::path& path) {
  return format_of_extension(path.extension().string());
}

std::string cell_formats_table() {
  std::string text =
      "| cells | read | written | orders read | orders written | face groups | regions | features |\n"
      "|---|---|---|---|---|---|---|---|\n";
  for (const FileFormat& format : kFormats)
    if (format.holds_cells)
      append_row(text,
                 {extension_cell(format), or_no(format.read), or_no(format.written), or_no(format.orders_read),
                  format.written.empty() ? "no" : or_no(format.orders_written),
                  both(said(format.groups_read), said(format.groups_written)),
                  both(said(format.regions_read), said(format.regions_written)), format.holds_features ? "yes" : "no"});
  return text;
}

std::string surface_formats_table() {
  std::string text = "| surfaces | read | written | face groups | features |\n|---|---|---|---|---|\n";
  for (const FileFormat& format : kFormats)
    if (!format.holds_cells)
      append_row(text,
                 {extension_cell(format), or_no(format.read), or_no(format.written),
                  both(said(format.groups_read), said(format.groups_written)), format.holds_features ? "yes" : "no"});
  return text;
}

std::string readable_formats(bool of_cells) {
  std::string text;
  for (const FileFormat& format : kFormats) {
    if (format.holds_cells != of_cells || format.read.empty()) continue;
    text.append(text.empty() ? "" : " ").append(format.extension);
  }
  return text;
}

std::string unknown_extension(const std::filesystem::path& path) {
  const std::string extension = lower_case(path.extension().string());
  const FileFormat* format = format_of_extension(extension);
  if (format && format->read.empty()) return "files with the extension " + extension + " are written, not read";
  std::string text = "unknown extension " + in_quotes(path.extension().string());
  for (const ForeignFiles& files : kForeignFiles)
    if ((" " + std::string(files.extensions) + " ").find(" " + extension + " ") != std::string::npos)
      text.append(" (").append(files.advice).append(")");
  return text;
}

}  // namespace subvol
