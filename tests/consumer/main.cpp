// SPDX-License-Identifier: GPL-3.0-or-later
#include <subvol/base/version.h>
#include <subvol/fit/quality/quality.h>
#include <subvol/fit/subdivision_fit.h>
#include <subvol/mesh/mesh_topology.h>
#include <subvol/subdivision/subdivision.h>
#include <subvol/surface/boundary.h>
#include <subvol/version_macros.h>

#include <array>
#include <cstdio>

static_assert(SUBVOL_VERSION_NUMBER >= 100 && SUBVOL_VERSION_MAJOR == 0);

// Fits a cube to its own boundary: every layer of the library is called, and all it links.
int main() {
  subvol::VolumeMesh cube;
  cube.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  cube.add_cell(subvol::CellKind::hex, std::array<subvol::Index, 8>{0, 1, 2, 3, 4, 5, 6, 7});
  const subvol::VolumeMesh fine = subvol::subdivide(subvol::subdivide(cube).fine).fine;
  const subvol::TriangleMesh target = subvol::triangulate(subvol::boundary_surface(fine, subvol::MeshTopology(fine)));
  const subvol::FitResult fit = subvol::fit_subdivision_volume(target, cube, {.levels = 1});
  const subvol::QualityReport quality = subvol::measure_quality(fit.mesh);
  std::printf("subvol %s: %zu cells, %zu proved valid\n", subvol::version(), quality.num_cells,
              quality.certificate.certified);
  return quality.num_cells == 8 && quality.certificate.all_certified() ? 0 : 1;
}
