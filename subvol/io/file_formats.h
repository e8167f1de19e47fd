// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace subvol {

/// How much of a kind of mark a format holds.
enum class Held {
  none,
  numbers,  ///< by number only
  names     ///< with names
};

/// A file format, by one of its extensions. This list is the one place that says which formats there are: the readers,
/// the writers, the program's help and the table of docs/file-formats.md follow it.
struct FileFormat {
  std::string_view extension;  ///< lower case, with its dot
  std::string_view name;
  bool holds_cells = false;                                      ///< else a surface
  std::string_view read{}, written{};                            ///< versions, or "yes"; empty: not read, not written
  std::string_view orders_read{}, orders_written{};              ///< of cells
  Held groups_read = Held::none, groups_written = Held::none;    ///< groups of faces
  Held regions_read = Held::none, regions_written = Held::none;  ///< references of cells
  bool holds_features = false;                                   ///< creases and corners
  bool is_scene = false;                                         ///< a scene is written: also cutaways and animations
  /// True if cells of orders 1 and 2 are written, and none of higher ones.
  bool has_quadratic_cells_at_most() const;
  /// True if groups of faces are written and a face may be in several of them; else a face is written in the first one.
  bool holds_all_groups_of_faces() const;
  bool needs_netcdf = false, needs_cgns = false, needs_assimp = false;  ///< the library without which it is refused
};

/// Returns all formats: those of cells, then those of surfaces.
std::span<const FileFormat> file_formats();

/// Returns the format of an extension with its dot, in any case, or of a path; null if there is none.
const FileFormat* format_of_extension(std::string_view extension);
const FileFormat* format_of_path(const std::filesystem::path& path);

/// Returns the tables of docs/file-formats.md, as Markdown.
std::string cell_formats_table();
std::string surface_formats_table();

/// Returns the extensions of the formats that hold cells or surfaces and are read, as text: ".mesh .vtk .vtu".
std::string readable_formats(bool of_cells);

/// Returns what is wrong with the extension of a file that is not read: that it is unknown, and if it belongs to a
/// well-known kind of files, what to do with them.
std::string unknown_extension(const std::filesystem::path& path);

}  // namespace subvol
