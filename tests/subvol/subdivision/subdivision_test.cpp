// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/subdivision/subdivision.h"
#include "subvol/base/error.h"
#include "subvol/io/mesh_io.h"
#include "subvol/subdivision/row_assembly.h"
#include "tests/support/opensubdiv_oracle.h"
#include "tests/support/require_data.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/threads.h"

#include <catch2/catch.hpp>

namespace subvol::test {

using namespace internal;

namespace {

constexpr double kRowSumTolerance = 1e-14;  // some tens of additions of weights below 1
constexpr double kOracleTolerance = 1e-12;  // of the extent: rounding alone

double max_row_sum_error(const SparseMap& map) {
  double error = 0;
  for (std::size_t i = 0; i < map.num_rows(); ++i) {
    double sum = 0;
    for (double w : map.row_values(i)) sum += w;
    error = std::max(error, std::abs(sum - 1));
  }
  return error;
}

double min_weight(const SparseMap& map) { return *std::min_element(map.values.begin(), map.values.end()); }

double weight_at(const SparseMap& map, Index row, Index column) {
  const auto columns = map.row_columns(row);
  const auto it = std::lower_bound(columns.begin(), columns.end(), column);
  return it != columns.end() && *it == column ? map.row_values(row)[it - columns.begin()] : 0.0;
}

/// Largest distance between the boundary of `levels` refinements and OpenSubdiv's.
double oracle_distance(VolumeMesh mesh, int levels = 2) {
  double distance = 0;
  for (int level = 0; level < levels; ++level) {
    const OracleChildren oracle = oracle_children(mesh);
    const MeshTopology topology(mesh);
    const SubdivisionLevel refined = subdivide(mesh);
    const auto compare = [&](std::size_t child, const Vec3& expected) {
      distance = std::max(distance, (refined.fine.positions[child] - expected).norm());
    };
    for (std::size_t i = 0; i < oracle.vertices.size(); ++i) compare(oracle.vertices[i], oracle.vertex_children[i]);
    for (std::size_t e = 0; e < oracle.edges.size(); ++e)
      compare(mesh.num_vertices() + topology.find_edge(oracle.edges[e][0], oracle.edges[e][1]),
              oracle.edge_children[e]);
    mesh = refined.fine;
  }
  return distance;
}

std::vector<VolumeMesh> meshes_to_subdivide() {
  std::vector<VolumeMesh> meshes = {lattice(1, 1, 1), lattice(3, 2, 2),    l_shape(2),
                                    fan(4, 270, 2),   fan(5, 360 - 20, 1), mixed_cells()};
  for (VolumeMesh& mesh : meshes) jitter(mesh, 0.1);
  return meshes;
}

}  // namespace

TEST_CASE("what a row throws, or no memory for it, leaves the assembly of a map") {
  for (const std::size_t thrower : {3, 5000, 9999})
    CHECK_THROWS_AS(assemble_rows(10000, 10,
                                  [&](std::size_t i, RowBuilder& row) {
                                    row.add(static_cast<Index>(i % 10), 1);
                                    if (i == thrower) throw std::bad_alloc();
                                  }),
                    std::bad_alloc);
}

TEST_CASE("rows of the subdivision matrix sum to one and no weight is negative", "[subdivision]") {
  for (const VolumeMesh& untagged : meshes_to_subdivide())
    for (double sharpness : {0.0, kInfiniteSharpness, 2.5, 1.3, 0.4})
      for (BoundaryRule rule : {BoundaryRule::catmull_clark, BoundaryRule::averaging}) {
        VolumeMesh mesh = untagged;
        if (sharpness > 0) tag_creases(mesh, 40, sharpness);
        const SubdivisionLevel level = subdivide(mesh, rule);
        CHECK(max_row_sum_error(level.matrix) <= kRowSumTolerance);
        CHECK(subdivision_matrix(mesh, rule).values == level.matrix.values);
        CHECK(max_row_sum_error(linear_split(mesh)) <= kRowSumTolerance);
        CHECK(min_weight(level.matrix) >= 0);
        CHECK(level.matrix.num_cols == mesh.num_vertices());
        CHECK(level.matrix.num_rows() == level.fine.num_vertices());
      }
}

TEST_CASE("the boundary is OpenSubdiv's for smooth, creased and semi-sharp boundaries", "[subdivision][opensubdiv]") {
  for (const VolumeMesh& untagged : meshes_to_subdivide())
    for (double sharpness : {0.0, kInfiniteSharpness, 2.5, 1.3, 1.0, 0.4}) {
      VolumeMesh mesh = untagged;
      if (sharpness > 0) tag_creases(mesh, 40, sharpness);
      CAPTURE(mesh.num_cells(), sharpness);
      CHECK(oracle_distance(mesh) <= kOracleTolerance);
    }
}

TEST_CASE("the boundary is OpenSubdiv's for darts, corners and creases of different sharpness",
          "[subdivision][opensubdiv]") {
  VolumeMesh mesh = lattice(3, 2, 2);
  jitter(mesh, 0.1);
  tag_creases(mesh, 40);
  const std::vector<CreaseEdge> all = mesh.tags.creases;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    const std::array<double, 6> choices = {0.3, 0.7, 1.0, 1.6, 2.2, kInfiniteSharpness};
    mesh.tags = {};
    for (CreaseEdge crease : all)
      if (random() % 3) mesh.tags.creases.push_back({crease.v0, crease.v1, choices[random() % choices.size()]});
    for (Index v : {0, 3, 8})
      if (random() % 2) mesh.tags.corners.push_back({v, choices[random() % choices.size()]});
    CAPTURE(seed);
    CHECK(oracle_distance(mesh, 3) <= kOracleTolerance);
  }
}

TEST_CASE("the boundary is OpenSubdiv's on real templates of all cell kinds", "[subdivision][opensubdiv][data]") {
  const auto folder = require_data();
  if (!folder) return;
  for (const char* name : {"hanger139", "bone87", "cad_fandisk49", "joint129", "mixed_fandisk", "mixed_prismlayer_bone",
                           "mixed_screwdriver", "tet_bone144", "far_ball_spot", "rod59"})
    for (double sharpness : {0.0, kInfiniteSharpness, 2.5, 1.3, 0.4}) {
      VolumeMesh mesh = read_volume_mesh(*folder / "fit" / name / "template.mesh");
      if (sharpness > 0) tag_creases(mesh, 40, sharpness);
      double extent = 0;
      for (const Vec3& p : mesh.positions) extent = std::max(extent, p.cwiseAbs().maxCoeff());
      CAPTURE(name, sharpness);
      CHECK(oracle_distance(mesh) <= kOracleTolerance * extent);
    }
}

TEST_CASE("a fine mesh has one positive hex per cell corner, in order", "[subdivision]") {
  VolumeMesh mesh = mixed_cells();
  mesh.references = {4, 5, 6, 7};
  const SubdivisionLevel level = subdivide(mesh);
  REQUIRE(level.fine.num_cells() == mesh.cell_vertices.size());
  std::size_t fine = 0;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (Index v : mesh.cell(c)) {
      CHECK(level.fine.cell(fine)[0] == v);
      CHECK(level.fine.references[fine] == mesh.references[c]);
      ++fine;
    }
  VolumeMesh split = level.fine;
  split.positions = linear_split(mesh).apply(mesh.positions);
  CHECK(count_inverted(split) == 0);
}

TEST_CASE("interior rows of a lattice are the tricubic masks, to the bit", "[subdivision]") {
  const int n = 6;
  const VolumeMesh mesh = lattice(n, n, n);
  const SubdivisionLevel level = subdivide(mesh);
  const auto mask = [](int fine, int coarse) {  // one direction: [1 4 6 4 1]/8 by distance in half steps
    switch (std::abs(fine - 2 * coarse)) {
      case 0: return 6.0 / 8;
      case 1: return 4.0 / 8;
      case 2: return 1.0 / 8;
      default: return 0.0;
    }
  };
  const std::vector<Vec3> midpoints = linear_split(mesh).apply(mesh.positions);
  std::size_t interior = 0, wrong = 0;
  for (std::size_t i = 0; i < midpoints.size(); ++i) {
    std::array<int, 3> fine;
    for (int d = 0; d < 3; ++d) fine[d] = static_cast<int>(std::lround(2 * midpoints[i][d]));
    if (*std::min_element(fine.begin(), fine.end()) < 2 || *std::max_element(fine.begin(), fine.end()) > 2 * n - 2)
      continue;
    ++interior;
    wrong += level.fine.positions[i] != midpoints[i];
    wrong += level.matrix.row_size(i) > 27;
    for (std::size_t j = 0; j < mesh.num_vertices(); ++j) {
      double expected = 1;
      for (int d = 0; d < 3; ++d) expected *= mask(fine[d], static_cast<int>(mesh.positions[j][d]));
      wrong += weight_at(level.matrix, static_cast<Index>(i), static_cast<Index>(j)) != expected;
    }
  }
  CHECK(interior == 729);
  CHECK(wrong == 0);
}

TEST_CASE("a box with sharp edges stays on its lattice, to the bit", "[subdivision]") {
  VolumeMesh mesh = lattice(3, 2, 2);
  tag_creases(mesh, 40);
  for (int level = 0; level < 3; ++level) {
    const SubdivisionLevel refined = subdivide(mesh);
    const std::vector<Vec3> midpoints = linear_split(mesh).apply(mesh.positions);
    const bool equal = refined.fine.positions == midpoints;
    CHECK(equal);
    mesh = refined.fine;
  }
  CHECK(mesh.tags.creases.size() == 8 * 4 * (3 + 2 + 2));
}

TEST_CASE("rows of a crease are the cubic B-spline's", "[subdivision]") {
  VolumeMesh mesh = lattice(4, 1, 1);
  tag_creases(mesh, 40);
  const MeshTopology topology(mesh);
  const SubdivisionLevel level = subdivide(mesh);
  const auto at = [&](int i) {
    const auto it = std::find(mesh.positions.begin(), mesh.positions.end(), Vec3(i, 0, 0));
    return static_cast<Index>(it - mesh.positions.begin());
  };
  CHECK(weight_at(level.matrix, at(2), at(1)) == 1.0 / 8);
  CHECK(weight_at(level.matrix, at(2), at(2)) == 6.0 / 8);
  CHECK(weight_at(level.matrix, at(2), at(3)) == 1.0 / 8);
  CHECK(level.matrix.row_size(at(2)) == 3);
  const Index middle = static_cast<Index>(mesh.num_vertices()) + topology.find_edge(at(1), at(2));
  CHECK(weight_at(level.matrix, middle, at(1)) == 0.5);
  CHECK(weight_at(level.matrix, middle, at(2)) == 0.5);
}

TEST_CASE("tags lose one unit of sharpness per refinement and infinite ones stay", "[subdivision]") {
  VolumeMesh mesh = lattice(1, 1, 1);
  mesh.tags.creases = {{0, 1, 2.5}, {0, 3, kInfiniteSharpness}, {1, 2, 0.5}};
  std::sort(mesh.tags.creases.begin(), mesh.tags.creases.end(),
            [](const CreaseEdge& a, const CreaseEdge& b) { return std::pair(a.v0, a.v1) < std::pair(b.v0, b.v1); });
  mesh.tags.corners = {{2, 1.5}, {6, 1.0}};
  const FeatureTags tags = subdivide(mesh).fine.tags;
  REQUIRE(tags.creases.size() == 4);
  for (const CreaseEdge& crease : tags.creases) {
    CHECK(crease.v0 < crease.v1);
    CHECK((crease.sharpness == 1.5 || crease.sharpness == kInfiniteSharpness));
  }
  REQUIRE(tags.corners.size() == 1);
  CHECK(tags.corners[0] == CornerVertex{2, 0.5});
}

TEST_CASE("apply and apply_transposed are adjoint", "[subdivision]") {
  VolumeMesh mesh = lattice(4, 3, 3);
  const SubdivisionLevel level = subdivide(subdivide(mesh).fine);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Vec3> x(level.matrix.num_cols), y(level.matrix.num_rows()), back(x.size());
  for (Vec3& p : x) p = Vec3(uniform(random), uniform(random), uniform(random));
  for (Vec3& p : y) p = Vec3(uniform(random), uniform(random), uniform(random));
  const std::vector<Vec3> forward = level.matrix.apply(x);
  level.matrix.apply_transposed(y, back);
  double left = 0, right = 0, scale = 0;
  for (std::size_t i = 0; i < y.size(); ++i) left += forward[i].dot(y[i]), scale += std::abs(forward[i].dot(y[i]));
  for (std::size_t j = 0; j < x.size(); ++j) right += x[j].dot(back[j]);
  CHECK(std::abs(left - right) <= 1e-12 * scale);
}

TEST_CASE("one and two threads give the same bits", "[subdivision]") {
  VolumeMesh mesh = lattice(5, 4, 4);
  jitter(mesh, 0.2);
  tag_creases(mesh, 40, 1.5);
  subvol::test::ThreadGuard guard;
  guard.use(1);
  const SubdivisionLevel one = subdivide(subdivide(mesh).fine);
  guard.use(2);
  const SubdivisionLevel two = subdivide(subdivide(mesh).fine);
  CHECK(one.matrix.columns == two.matrix.columns);
  CHECK(one.matrix.values == two.matrix.values);
  CHECK(one.matrix.offsets == two.matrix.offsets);
  CHECK(one.fine.positions == two.fine.positions);
  CHECK(one.fine.cell_vertices == two.fine.cell_vertices);
}

TEST_CASE("renumbering the vertices moves the fine mesh by rounding only", "[subdivision]") {
  VolumeMesh mesh = lattice(2, 3, 2);
  jitter(mesh, 0.2);
  const Index last = static_cast<Index>(mesh.num_vertices()) - 1;
  VolumeMesh renumbered = mesh;
  std::reverse(renumbered.positions.begin(), renumbered.positions.end());
  for (Index& v : renumbered.cell_vertices) v = last - v;
  const SubdivisionLevel a = subdivide(mesh), b = subdivide(renumbered);
  double distance = 0;  // compared through the cells, whose order is the same
  for (std::size_t i = 0; i < a.fine.cell_vertices.size(); ++i)
    distance = std::max(distance,
                        (a.fine.positions[a.fine.cell_vertices[i]] - b.fine.positions[b.fine.cell_vertices[i]]).norm());
  CHECK(distance <= 1e-14 * 3);
}

TEST_CASE("cells around reflex creases stay positive level by level", "[subdivision]") {
  struct Case {
    VolumeMesh mesh;
    double jitter;
  };
  for (const auto& [shape, amount] : {Case{l_shape(3), 0.1}, Case{fan(3, 330, 3), 0.1}, Case{fan(4, 270, 3), 0.1},
                                      Case{fan(4, 320, 3), 0.1}, Case{fan(2, 250, 3), 0.1}})
    for (double sharpness : {kInfiniteSharpness, 2.5, 1.3, 0.4}) {
      VolumeMesh mesh = shape;
      jitter(mesh, amount);
      tag_creases(mesh, 40, sharpness);
      REQUIRE(count_inverted(mesh) == 0);
      for (int level = 1; level <= 3; ++level) {
        mesh = subdivide(mesh).fine;
        CAPTURE(shape.num_cells(), sharpness, level);
        CHECK(count_inverted(mesh) == 0);
      }
    }
}

TEST_CASE("cells along a reflex crease stay positive where its faces shrink at different speeds", "[subdivision]") {
  // The sheets start much shorter than the boundary faces. Plain interior rows amplify that until the sheets leave the
  // volume (from level 3 on). At the ends of the crease the boundary itself folds, so only the middle is looked at.
  for (int sectors : {2, 3, 4}) {
    constexpr int kLayers = 6;
    VolumeMesh mesh = fan(sectors, 270, kLayers);
    const Index layer = 2 * sectors + 2;
    for (int k = 0; k <= kLayers; ++k)
      for (int ray = 1; ray < sectors; ++ray)
        mesh.positions[layer * k + 1 + 2 * ray].head<2>() *= sectors < 4 ? 0.4 : 0.5;
    tag_creases(mesh, 40);
    const std::size_t num_cells = mesh.num_cells();
    for (int level = 1; level <= 4; ++level) {
      mesh = subdivide(mesh).fine;
      std::size_t inverted = 0;
      for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
        const std::size_t parent = c * num_cells / mesh.num_cells(), layer_of_cell = parent / sectors;
        const bool in_middle = layer_of_cell == kLayers / 2 || layer_of_cell == kLayers / 2 - 1;
        inverted += in_middle && min_scaled_jacobian(mesh, c) <= 0;
      }
      CAPTURE(sectors, level);
      CHECK(inverted == 0);
    }
  }
}

TEST_CASE("what cannot be subdivided is refused with its name", "[subdivision]") {
  CHECK_THROWS_AS(subdivide(VolumeMesh{}), InputError);
  VolumeMesh mesh = lattice(2, 1, 1);
  mesh.cell_vertices[3] = 99;
  CHECK_THROWS_AS(subdivide(mesh), InputError);
  mesh = voxels(2, 2, 1, [](int i, int j, int) { return i == j; });  // two cubes sharing an edge
  CHECK_THROWS_WITH(subdivide(mesh), Catch::Contains("boundary: 1 edge has more than two faces"));
  mesh = voxels(2, 2, 2, [](int i, int j, int k) { return i == j && j == k; });  // two cubes sharing a vertex
  CHECK_THROWS_WITH(subdivide(mesh), Catch::Contains("boundary vertex"));
  mesh = lattice(2, 2, 2);
  mesh.tags.creases = {{0, 26, 1.0}};
  CHECK_THROWS_WITH(subdivide(mesh), Catch::Contains("crease 0-26"));
  mesh.tags.creases = {{0, 1, -1.0}};
  CHECK_THROWS_AS(subdivide(mesh), InputError);
  mesh.tags = {};
  mesh.tags.corners = {{99, 1.0}};
  CHECK_THROWS_AS(subdivide(mesh), InputError);
}

}  // namespace subvol::test
