// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/subdivision/limit_patches.h"

#include "subvol/base/error.h"
#include "subvol/subdivision/limit_surface.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

constexpr int kLevels = 4;                // of patches, in the twin
constexpr double kPatchRounding = 1e-12;  // of lengths near 1 after a few dozen operations
constexpr double kDartNormals = 1e-4;     // header of limit_masks.h: darts are good to 2e-5

using Place = std::array<int, 2>;

/// Calls visit(corner of a refined quad, its parameters) for all quads below one.
template <class Visit>
void descend(std::size_t quad, int levels, const std::array<Place, 4>& corners, Visit&& visit) {
  if (levels == 0) {
    for (int k = 0; k < 4; ++k) visit(quad, k, corners[k]);
    return;
  }
  const auto halfway = [](Place a, Place b) { return Place{(a[0] + b[0]) / 2, (a[1] + b[1]) / 2}; };
  for (int k = 0; k < 4; ++k)
    descend(4 * quad + k, levels - 1,
            {corners[k], halfway(corners[k], corners[(k + 1) % 4]), halfway(corners[0], corners[2]),
             halfway(corners[(k + 3) % 4], corners[k])},
            visit);
}

std::vector<int> uniform_parameters(int depth) {
  std::vector<int> t;
  for (int i = 0; i <= 1 << depth; ++i) t.push_back(i * (LimitPatches::kPatchSideUnits >> depth));
  return t;
}

/// Largest differences between patches and refinement with limit masks of every vertex.
struct Difference {
  double position = 0, normal = 0;
};

Difference compare(const VolumeMesh& cage) {
  const BoundaryRefinement refined = refine_boundary(cage, kLevels + 1, true);
  const std::vector<Vec3> points = refined.positions.apply(cage.positions);
  const std::vector<Vec3> normals = limit_normals(refined, cage.positions, points);
  LimitPatches patches(cage);
  patches.prepare(kLevels);
  const std::vector<int> t = uniform_parameters(kLevels);
  std::vector<Vec3> p(t.size() * t.size()), n(p.size());
  Difference difference;
  for (std::size_t patch = 0; patch < patches.num_patches(); ++patch) {
    patches.evaluate(static_cast<Index>(patch), t, t, p.data(), n.data());
    const int size = 1 << kLevels;
    descend(patch, kLevels, {Place{0, 0}, {size, 0}, {size, size}, {0, size}}, [&](std::size_t quad, int k, Place at) {
      const std::size_t i = at[1] * t.size() + at[0];
      difference.position = std::max(difference.position, (points[refined.quads[quad][k]] - p[i]).norm());
      const Vec3& normal = normals[refined.quad_sites[quad][k]];
      if (n[i] != Vec3::Zero())  // parallel tangents
        difference.normal = std::max(difference.normal, std::min((normal - n[i]).norm(), (normal + n[i]).norm()));
    });
  }
  return difference;
}

VolumeMesh jittered(VolumeMesh mesh) {
  jitter(mesh, 0.1);
  return mesh;
}

VolumeMesh creased(VolumeMesh mesh, double sharpness = kInfiniteSharpness) {
  tag_creases(mesh, 40, sharpness);
  return jittered(std::move(mesh));
}

}  // namespace

TEST_CASE("patches agree with refinement and limit masks at every kind of smooth vertex") {
  for (const VolumeMesh& cage : {jittered(lattice(2, 2, 1)), jittered(mixed_cells()), jittered(fan(5, 300, 2))}) {
    const Difference difference = compare(cage);
    CHECK(difference.position < kPatchRounding);
    CHECK(difference.normal < 1e-8);
  }
}

TEST_CASE("patches agree with refinement and limit masks beside creases, corners and semi-sharp features") {
  VolumeMesh box = creased(lattice(2, 1, 1));
  for (Index v : {0, 2}) box.tags.corners.push_back({v});
  VolumeMesh blunt = creased(lattice(2, 1, 1), 1.7);
  blunt.tags.corners.push_back({0, 2.3});
  for (const VolumeMesh& cage : {box, blunt, creased(l_shape(2)), creased(mixed_cells()), creased(fan(5, 300, 2))})
    CHECK(compare(cage).position < kPatchRounding);
  CHECK(compare(box).normal < 1e-8);
  CHECK(compare(blunt).normal < 1e-8);
}

TEST_CASE("patches agree with refinement and limit masks at the end of a crease") {
  VolumeMesh dart = jittered(lattice(2, 2, 1));
  dart.tags.creases.push_back({0, 1});
  const Difference difference = compare(dart);
  CHECK(difference.position < kPatchRounding);
  CHECK(difference.normal < kDartNormals);
}

TEST_CASE("a patch is continued by its neighbor at the same parameter of their common side") {
  LimitPatches patches(creased(mixed_cells(), 1.3));
  patches.prepare(3);
  const SurfaceTopology& quads = patches.quads();
  const std::vector<int> t = uniform_parameters(3), low = {0}, high = {LimitPatches::kPatchSideUnits};
  const auto side = [&](Index h) {
    std::vector<Vec3> points(t.size());
    const bool along_u = h % 2 == 0;
    const std::vector<int>& fixed = h % 4 == 0 || h % 4 == 3 ? low : high;
    patches.evaluate(h / 4, along_u ? t : fixed, along_u ? fixed : t, points.data());
    return points;
  };
  for (std::size_t h = 0; h < quads.corner_vertices.size(); ++h) {
    const std::vector<Vec3> here = side(static_cast<Index>(h)), there = side(quads.twins[h]);
    for (std::size_t i = 0; i < t.size(); ++i) CHECK((here[i] - there[i]).norm() < kPatchRounding);
  }
}

TEST_CASE("depth needs no more than what is irregular: a deep sample equals the limit of its corner") {
  const VolumeMesh cage = creased(l_shape(2));
  LimitPatches patches(cage);
  patches.prepare(LimitPatches::kMostPatchDepth);
  const std::vector<Vec3> limit = limit_map(cage).apply(cage.positions);
  const MeshTopology topology(cage);
  const std::vector<int> ends = {0, 1};
  for (std::size_t p = 0; p < patches.num_patches(); ++p) {
    std::array<Vec3, 4> points;
    patches.evaluate(static_cast<Index>(p), ends, ends, points.data());
    const auto [face, corner] = patches.face_corner(static_cast<Index>(p));
    const Vec3& at = limit[topology.face(topology.boundary_faces()[face])[corner]];
    CHECK((points[0] - at).norm() < kPatchRounding);
    for (const Vec3& q : points) CHECK((q - at).norm() < 0.05);  // 0.6^14 and more of a patch
  }
}

TEST_CASE("patches refuse tags that are not on the boundary") {
  VolumeMesh cage = lattice(1, 1, 1);
  cage.tags.creases.push_back({0, 6});
  CHECK_THROWS_AS(LimitPatches(cage), InputError);
}
