// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/exodus_blocks.h"

namespace subvol::internal {

std::mutex& netcdf_lock() {
  static std::mutex lock;
  return lock;
}

const char* kind_suffix(CellKind kind) {
  constexpr const char* kSuffixes[] = {"_tets", "_prisms", "_hexes", "_pyramids"};
  return kSuffixes[static_cast<std::size_t>(kind)];
}

std::vector<std::size_t> exodus_places(CellKind kind, std::size_t num_nodes) {
  std::vector<std::size_t> places;
  if (kind == CellKind::hex)
    places = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 16, 17, 18, 19, 12, 13, 14, 15, 23, 24, 25, 26, 21, 22, 20};
  else if (kind == CellKind::prism)
    places = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 13, 14, 9, 10, 11, 15, 16, 17};
  else
    places = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
  places.resize(num_nodes);
  return places;
}

}  // namespace subvol::internal
