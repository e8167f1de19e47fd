// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/region_surface.h"

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// The figures of one region, that is, of the cells of one reference.
struct RegionQuality {
  int reference;
  std::string name;  ///< of its group in `VolumeMesh::regions`; may be empty
  std::size_t num_cells = 0, num_uncertified = 0;
  double volume = 0;
  double area = 0;  ///< of its faces on the boundary
  double min_scaled_jacobian = 1;
};

/// The figures of the faces between two regions.
struct InterfaceArea {
  std::array<int, 2> references;
  std::size_t num_faces = 0;
  double area = 0;
};

/// The figures of all regions of a mesh, and of their interfaces.
struct RegionReport {
  std::vector<RegionQuality> regions;     ///< ascending by reference
  std::vector<InterfaceArea> interfaces;  ///< ascending by pair
};

/// Measures the regions of a mesh of linear cells. quality: of this mesh; null: only volumes and areas are set.
///
/// Volumes are those of the cells with bilinear quads. Areas are those of four triangles for each quad. Index-correct
/// cells are expected. Cost: linear.
RegionReport measure_regions(const VolumeMesh& mesh, const QualityReport* quality);

/// References of the cells of a mesh that does not hold them, and their names.
struct CellLabels {
  std::span<const int> references{};  ///< one per cell, or empty: all 0
  std::span<const Group> regions{};
};

/// Measures the regions of a mesh of curved cells in the same way.
///
/// Volumes and areas are integrals over the curved faces between regions and on the boundary, by Gauss quadrature. With
/// Legendre modes, volumes are exact up to rounding. InputError: another number of references than of cells. Parallel;
/// the same bits for any number of threads. Cost: that of a few dozen points per face at order 4.
RegionReport measure_regions(const HighOrderMesh& mesh, const CellLabels& labels, const QualityReport* quality);

/// Measures the regions of a surface: names, volumes and areas; the numbers of faces are those of triangles.
RegionReport measure_regions(const RegionSurface& surface);

/// Returns the volumes of the regions, ascending by reference. Cost: linear.
std::vector<double> region_volumes(const VolumeMesh& mesh);

}  // namespace subvol
