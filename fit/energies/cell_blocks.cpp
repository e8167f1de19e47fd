// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/cell_blocks.h"

#include "subvol/base/error.h"

#include <bit>
#include <cstdint>
#include <limits>
#include <string>

namespace subvol::internal {

std::vector<int> color_cells(const VolumeMesh& mesh) {
  std::vector<std::vector<std::uint64_t>> used;  // one bit mask per vertex for every 64 colors
  std::vector<int> colors(mesh.num_cells());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    std::size_t word = 0;
    for (;; ++word) {
      if (word == used.size()) used.emplace_back(mesh.num_vertices(), 0);
      std::uint64_t mask = 0;
      for (Index v : mesh.cell(c)) mask |= used[word][v];
      if (~mask == 0) continue;
      const int bit = std::countr_one(mask);
      for (Index v : mesh.cell(c)) used[word][v] |= std::uint64_t{1} << bit;
      colors[c] = static_cast<int>(64 * word) + bit;
      break;
    }
  }
  return colors;
}

CellBlocks::CellBlocks(const VolumeMesh& mesh)
    : pattern_(clique_pattern(mesh.num_vertices(), mesh.cell_offsets, mesh.cell_vertices)), offsets_{0} {
  if (pattern_.num_entries() > std::numeric_limits<Index>::max())
    throw InputError("a mesh of " + std::to_string(mesh.num_vertices()) +
                     " vertices has more pairs of them in cells than can be numbered");
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    offsets_.push_back(offsets_.back() + mesh.cell(c).size() * mesh.cell(c).size());
  slots_.resize(offsets_.back());
#pragma omp parallel for schedule(static)
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const auto cell = mesh.cell(c);
    std::size_t slot = offsets_[c];
    for (Index a : cell)
      for (Index b : cell) slots_[slot++] = static_cast<Index>(pattern_.find(a, b));
  }
}

BlockSparse CellBlocks::zero_matrix() const {
  BlockSparse result = pattern_;
  result.set_zero();
  return result;
}

}  // namespace subvol::internal
