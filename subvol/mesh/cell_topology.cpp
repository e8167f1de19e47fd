// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/mesh/cell_topology.h"

namespace subvol {

namespace {

constexpr std::array<std::int8_t, 2> kNoEdge = {-1, -1};
constexpr std::array<std::int8_t, 3> kNoCorner = {-1, -1, -1};

constexpr std::array<CellTopology, kNumCellKinds> kTables = {{
    {"tet",
     4,
     6,
     4,
     {{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}, kNoEdge, kNoEdge, kNoEdge, kNoEdge, kNoEdge, kNoEdge}},
     {3, 3, 3, 3, -1, -1},
     {{{0, 2, 1, -1}, {0, 1, 3, -1}, {1, 2, 3, -1}, {2, 0, 3, -1}, {-1, -1, -1, -1}, {-1, -1, -1, -1}}},
     4,
     {{{1, 2, 3}, {2, 0, 3}, {0, 1, 3}, {0, 2, 1}, kNoCorner, kNoCorner, kNoCorner, kNoCorner}}},
    {"prism",
     6,
     9,
     5,
     {{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 4}, {2, 5}, {3, 4}, {4, 5}, {5, 3}, kNoEdge, kNoEdge, kNoEdge}},
     {3, 3, 4, 4, 4, -1},
     {{{0, 2, 1, -1}, {3, 4, 5, -1}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}, {-1, -1, -1, -1}}},
     6,
     {{{1, 2, 3}, {2, 0, 4}, {0, 1, 5}, {5, 4, 0}, {3, 5, 1}, {4, 3, 2}, kNoCorner, kNoCorner}}},
    {"hex",
     8,
     12,
     6,
     {{{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 4}, {1, 5}, {2, 6}, {3, 7}, {4, 5}, {5, 6}, {6, 7}, {7, 4}}},
     {4, 4, 4, 4, 4, 4},
     {{{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}},
     8,
     {{{1, 3, 4}, {2, 0, 5}, {3, 1, 6}, {0, 2, 7}, {7, 5, 0}, {4, 6, 1}, {5, 7, 2}, {6, 4, 3}}}},
    {"pyramid",
     5,
     8,
     5,
     {{{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 4}, {1, 4}, {2, 4}, {3, 4}, kNoEdge, kNoEdge, kNoEdge, kNoEdge}},
     {4, 3, 3, 3, 3, -1},
     {{{0, 3, 2, 1}, {0, 1, 4, -1}, {1, 2, 4, -1}, {2, 3, 4, -1}, {3, 0, 4, -1}, {-1, -1, -1, -1}}},
     4,
     {{{1, 3, 4}, {2, 0, 4}, {3, 1, 4}, {0, 2, 4}, kNoCorner, kNoCorner, kNoCorner, kNoCorner}}},
}};

}  // namespace

const CellTopology& cell_topology(CellKind kind) { return kTables[static_cast<std::size_t>(kind)]; }

}  // namespace subvol
