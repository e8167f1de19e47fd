// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/quality_caps.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/templates/search_stop.h"

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace subvol::internal {

/// A mesh of which some cells are smaller than the others on purpose.
struct SizedMesh {
  VolumeMesh mesh;
  std::vector<double> sizes;  ///< for each cell, the length of its edges beside that of cells of size 1; empty: all 1
};

/// Cells at which a fit is not as good as aimed at, for one reason: ascending.
using Fault = std::vector<Index>;

/// Cuts the cells of faults in 27 (`refine_locally`): of the faults in their order, each that there is room for.
///
/// mesh    hexes; parts of warped ones may be inverted in the result.
/// sizes   of its cells, or empty; those of the result are smaller by the third root of the number of parts.
/// faults  the most important first.  most_cells  that the result may have.
/// stop    asked before each refinement; null: it is not stopped.
/// returns nothing if there is no room for one, if no fault has a cell, or if it was stopped.
/// Cost: up to two dozen refinements.
std::optional<SizedMesh> refined_at_faults(const VolumeMesh& mesh, std::span<const double> sizes,
                                           std::span<const Fault> faults, std::size_t most_cells,
                                           SearchStop* stop = nullptr);

/// Returns the mean of a cell's corners.  positions  of the mesh's vertices.
Vec3 cell_center(const VolumeMesh& mesh, std::span<const Vec3> positions, std::size_t cell);

/// Returns the sizes of a mesh that was padded: cells beyond the given ones have that of a cell behind them. Empty if
/// the sizes are.
std::vector<double> padded_sizes(const VolumeMesh& padded, std::span<const double> sizes);

/// Returns the cells between small and large ones, ascending: those whose size is no power of 1/3 (`refine_locally`).
std::vector<Index> cells_between_sizes(std::span<const double> sizes);

/// Adds bounds on the scaled Jacobian in cells between small and large ones. A flat layer of them around small cubes
/// has 0.55 at best: it was optimized alone. sizes  of the cells, or empty.  caps  receives bounds at the edges and
/// corners of these cells.
void add_caps_between_sizes(const VolumeMesh& mesh, std::span<const double> sizes, QualityCaps& caps);

/// Returns the lengths of edges that cells are to have (`QualityStages`): in proportion to their sizes, and such that
/// the boundary faces together have an area. sizes: of the cells, or empty.
std::vector<Vec3> wanted_lengths(const MeshTopology& topology, std::span<const double> sizes, std::size_t num_cells,
                                 double area);

/// Lowers the wanted lengths of flat cells, such as those of a grid through the sides of a thin plate, to their own
/// mean edge lengths. Otherwise `QualityEnergy`, which keeps edges from being short, would make the plate thicker.
///
/// grid     the grid that the mesh was made from. Nothing is done unless most of its cells are flat. Flat cells at a
///          ledge or a thin wall of another part are better off if they become thicker: for those of a nut's block, the
///          least scaled Jacobians of the first trials fell from 0.37 and more to 0.06 and less.
/// share    cells are flat if an edge is shorter than this share of the wanted length (`QualityWeights::least_edge`).
/// lengths  of the mesh's cells.
void keep_flat_cells(const VolumeMesh& grid, const VolumeMesh& mesh, double share, std::span<Vec3> lengths);

}  // namespace subvol::internal
