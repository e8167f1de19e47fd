// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Comparisons of written files with what went into them, one for each group of formats. A file is read again, and the
// first difference is thrown: the functions of read_back.h choose among these by the file's extension.

#include "subvol/base/error.h"
#include "subvol/export/cell_text.h"
#include "subvol/export/high_order_file.h"
#include "subvol/export/scene.h"
#include "subvol/io/nodal_mesh.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <numeric>
#include <span>
#include <string>
#include <vector>

namespace subvol::internal {

/// Largest difference of coordinates in formats of few digits, relative to the extent of the cell or the surface.
inline constexpr double kMostReadBackErrorShare = 1e-6;

/// A file that is compared with what was written to it. A difference throws IoError, with the file's name.
class WrittenFile {
 public:
  explicit WrittenFile(const std::filesystem::path& path) : path_(path) {}

  [[noreturn]] void differs(const std::string& what) const {
    throw IoError(path_.string() + ": was written, but does not hold what it should: " + what);
  }
  void same_count(const std::string& what, std::size_t found, std::size_t wanted) const {
    if (found != wanted) differs(std::to_string(found) + ' ' + what + ", expected " + std::to_string(wanted));
  }
  void same(bool same, const char* what, std::size_t number) const {
    if (!same) differs(what + (' ' + std::to_string(number)));
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Returns the reference of a cell; an empty list holds only zeros.
inline int reference_of(std::span<const int> references, std::size_t c) {
  return references.empty() ? 0 : references[c];
}

/// Returns the numbers of cells sorted by a key, and by number for equal keys.
template <class Key>
std::vector<std::size_t> sorted_cells(std::size_t num_cells, const Key& key) {
  std::vector<std::size_t> order(num_cells);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  return order;
}

/// Compares a .mesh with its groups and tags, or a .vtk.
void compare_linear(const WrittenFile& file, const VolumeMesh& wanted, bool is_medit);
/// Compares the cells of a .vtu.
void compare_vtu(const WrittenFile& file, const CellView& wanted);
/// Compares the map of curved cells that a .vtu holds beside its cells.
void compare_map(const WrittenFile& file, const HighOrderMesh& wanted, const HighOrderFileOptions& options);
/// Compares a .msh: its text of version 4.1, and what the reader sees of version 2.2.
void compare_msh(const WrittenFile& file, const CellView& wanted, MshVersion version);
/// Compares an .inp, .bdf, .mfem, .e, .exo or .xdmf. The whole text is made again: these writers are a function of the
/// cells alone. The reader then sees its cells.
void compare_nodal(const WrittenFile& file, const NodalMesh& wanted);
/// Compares an .obj or .usda; the bytes of a .stl, .ply, .vtp or .3mf.
void compare_surface(const WrittenFile& file, const PolygonMesh& wanted);
/// Compares a .glb or .gltf.
void compare_scene(const WrittenFile& file, const Scene& wanted);

}  // namespace subvol::internal
