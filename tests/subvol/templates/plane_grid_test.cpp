// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/plane_grid.h"

#include "subvol/base/error.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/validate.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/solid_topology.h"
#include "subvol/templates/auto_template.h"
#include "subvol/templates/solid_fraction.h"
#include "subvol/templates/voxel_grid.h"
#include "subvol/templates/voxel_score.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/surface_fixtures.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>

using namespace subvol;
using namespace subvol::internal;

namespace {

using Lines = std::array<std::vector<double>, 3>;

Mat3 turn_of(double degrees) {
  return Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vec3(1, 2, 3).normalized()).toRotationMatrix();
}

TriangleMesh surface_of(const VolumeMesh& mesh) { return triangulate(boundary_surface(mesh, MeshTopology(mesh))); }

TriangleMesh turned(TriangleMesh surface, const Mat3& turn) {
  for (Vec3& p : surface.positions) p = turn * p;
  return surface;
}

/// Boundary of those cells between given lines that `keep(i, j, k)` selects.
TriangleMesh block(const Lines& lines, const std::function<bool(int, int, int)>& keep) {
  const auto count = [&](std::size_t axis) { return static_cast<int>(lines[axis].size()) - 1; };
  VolumeMesh mesh = test::voxels(count(0), count(1), count(2), keep);
  for (Vec3& p : mesh.positions)
    for (std::size_t a = 0; a < 3; ++a)
      p[static_cast<Index>(a)] = lines[a][static_cast<std::size_t>(std::lround(p[static_cast<Index>(a)]))];
  return surface_of(mesh);
}

TriangleMesh box(const Vec3& size) {
  return block({{{0, size.x()}, {0, size.y()}, {0, size.z()}}}, [](int, int, int) { return true; });
}

/// Prism over a regular polygon around the z axis, of radius 1 and height 2.
TriangleMesh cylinder(Index n) {
  TriangleMesh mesh;
  mesh.positions = {Vec3(0, 0, -1), Vec3(0, 0, 1)};
  for (Index i = 0; i < n; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.3) / n;
    for (const double z : {-1.0, 1.0}) mesh.positions.emplace_back(std::cos(angle), std::sin(angle), z);
    const Index a = 2 + 2 * i, b = 2 + 2 * ((i + 1) % n);
    mesh.triangles.insert(mesh.triangles.end(), {{0, b, a}, {1, a + 1, b + 1}, {a, b, b + 1}, {a, b + 1, a + 1}});
  }
  return mesh;
}

/// Prism of height 2 over a rectangle of 4 by 3 whose corner at (4, 3) is cut off by a chamfer.
TriangleMesh chamfered_block(double width) {
  const std::array<std::array<double, 2>, 5> outline{{{0, 0}, {4, 0}, {4, 3 - width}, {4 - width, 3}, {0, 3}}};
  TriangleMesh mesh;
  for (const double z : {0.0, 2.0})
    for (const auto& [x, y] : outline) mesh.positions.emplace_back(x, y, z);
  for (Index i = 0; i < 5; ++i) {
    const Index j = (i + 1) % 5;
    mesh.triangles.push_back({i, j, j + 5});
    mesh.triangles.push_back({i, j + 5, i + 5});
  }
  for (Index i = 1; i < 4; ++i) {
    mesh.triangles.push_back({0, i + 1, i});
    mesh.triangles.push_back({5, 5 + i, 6 + i});
  }
  return mesh;
}

/// The only template through the planes of a surface; its mesh and its topology are right.
AutoTemplate made_through(const TriangleMesh& surface, std::size_t cells, bool pillow = false) {
  const AutoTemplateResult result = auto_templates(surface, {.cells = cells, .pillow = pillow, .through_planes = true});
  REQUIRE(result.templates.size() == 1);
  const AutoTemplate& made = result.templates.front();
  for (const MeshDefect& defect : validate(made.mesh)) FAIL_CHECK(defect.message);
  CHECK(solid_boundary(surface_of(made.mesh)).topology == result.wanted);
  CHECK(made.cells_asked == cells);
  CHECK(made.pillowed == pillow);
  for (std::size_t c = 0; c < made.mesh.num_cells(); ++c) CHECK(test::min_scaled_jacobian(made.mesh, c) > 0);
  return made;
}

void check_same_volume(const AutoTemplate& made, const TriangleMesh& surface) {
  CHECK(solid_boundary(surface_of(made.mesh)).volume == Approx(solid_boundary(surface).volume).epsilon(1e-12));
}

/// True if a plane with a unit normal, at a position along it, holds lines of the template's grid.
bool has_line(const AutoTemplate& made, const Vec3& direction, double position) {
  for (std::size_t a = 0; a < 3; ++a) {
    const double along = made.axes.col(static_cast<Index>(a)).dot(direction);
    if (std::abs(along) < 1 - 1e-12) continue;
    for (double line : made.lines[a])
      if (std::abs(along * line - position) < 1e-12 * (1 + std::abs(position))) return true;
  }
  return false;
}

std::size_t num_lines_along(const AutoTemplate& made, const Vec3& direction) {
  Index axis = 0;
  (made.axes.transpose() * direction).cwiseAbs().maxCoeff(&axis);
  return made.lines[static_cast<std::size_t>(axis)].size();
}

}  // namespace

TEST_CASE("A grid through a turned cube's planes has the cube's boundary", "[templates]") {
  for (const double degrees : {0.0, 0.7, 2.0, 20.0}) {
    INFO(degrees);
    const Mat3 turn = turn_of(degrees);
    const TriangleMesh cube = turned(test::cube_surface(6, false), turn);
    const AutoTemplate made = made_through(cube, 130);
    CHECK(made.mesh.num_cells() == 125);
    CHECK(made.aligned_share == Approx(1));
    CHECK(made.score == Approx(0).margin(1e-12));
    for (Index a = 0; a < 3; ++a) {
      CHECK(made.lines[static_cast<std::size_t>(a)].size() == 6);
      for (const double side : {-1.0, 1.0}) CHECK(has_line(made, turn.col(a), side));
    }
    for (const Vec3& p : surface_of(made.mesh).positions)
      CHECK(std::abs((turn.transpose() * p).cwiseAbs().maxCoeff() - 1) < 1e-12);
  }
}

TEST_CASE("Fillets do not turn the frame off the planes", "[templates]") {
  TriangleMesh rounded = test::cube_surface(40, false);
  for (Vec3& p : rounded.positions) {  // edges become quarter circles, larger on one side
    const double radius = p.x() > 0 ? 0.4 : 0.2;
    const Vec3 core = p.cwiseMax(-(1 - radius)).cwiseMin(1 - radius);
    p = core + radius * (p - core).normalized();
  }
  const Mat3 turn = turn_of(20);
  const AutoTemplate made = made_through(turned(rounded, turn), 130);
  CHECK(((made.axes.transpose() * turn).cwiseAbs().colwise().maxCoeff().array() > 1 - 1e-9).all());
  CHECK(made.aligned_share > 0.4);
}

TEST_CASE("A grid through an L-block's planes is exact, with a pillow as well", "[templates]") {
  const Lines lines{{{0, 1, 2.37}, {0, 0.83, 2.2}, {0, 1.1}}};
  const Mat3 turn = turn_of(20);
  const TriangleMesh surface = turned(block(lines, [](int i, int j, int) { return i == 0 || j == 0; }), turn);
  for (const bool pillow : {false, true}) {
    const AutoTemplate made = made_through(surface, 200, pillow);
    CHECK(made.mesh.num_cells() >= kLeastShareThroughPlanes * 200);
    CHECK(made.mesh.num_cells() <= kMostShareThroughPlanes * 200);
    CHECK(made.aligned_share == Approx(1));
    check_same_volume(made, surface);
    for (Index a = 0; a < 3; ++a)
      for (double position : lines[static_cast<std::size_t>(a)]) CHECK(has_line(made, turn.col(a), position));
  }
}

TEST_CASE("A thin plate becomes one layer of flat cells", "[templates][slow]") {
  const TriangleMesh plate = box(Vec3(200, 100, 1));
  for (const std::size_t cells : {50, 130, 1000}) {
    INFO(cells);
    const AutoTemplate made = made_through(plate, cells);
    CHECK(num_lines_along(made, Vec3::UnitZ()) == 2);
    CHECK(made.mesh.num_cells() > 0.75 * static_cast<double>(cells));
    CHECK(made.mesh.num_cells() < 1.3 * static_cast<double>(cells));
    check_same_volume(made, plate);
  }
  CHECK(num_lines_along(made_through(plate, 130, true), Vec3::UnitZ()) == 2);
  // As thin as a surface may be that bounds a volume.
  const TriangleMesh foil = box(Vec3(3e5, 3e5, 1));
  check_same_volume(made_through(foil, 100), foil);
  CHECK_THROWS_AS(auto_templates(foil, {.cells = 20000}), InputError);  // too large a grid of cubes
  check_same_volume(made_through(foil, 20000), foil);
}

TEST_CASE("Lines are close together only across thin walls and gaps", "[templates]") {
  const auto lines_of = [](const TriangleMesh& surface, double size) {
    return lines_through_planes(surface, axis_planes(surface, Mat3::Identity()), size, 1e6)[2];
  };
  const auto everywhere = [](int, int, int) { return true; };
  using Positions = std::vector<double>;
  // A gap: two plates joined along one side.
  const Lines gap{{{0, 1, 9}, {0, 10}, {0, 3, 3.2, 6}}};
  CHECK(lines_of(block(gap, [](int i, int, int k) { return i == 0 || k != 1; }), 3) == Positions{0, 3, 3.2, 6});
  // The same gap is too small for larger cells.
  CHECK(lines_of(block({{{0, 9, 10}, {0, 2}, {0, 3, 3.2, 6}}}, [](int i, int, int k) { return i == 0 || k != 1; }), 3)
            .size() == 3);
  // A step: both planes look up.
  const Lines step{{{0, 5, 10}, {0, 10}, {0, 3, 3.2}}};
  CHECK(lines_of(block(step, [](int i, int, int k) { return i == 0 || k == 0; }), 3).size() == 2);
  // Two blocks at different heights: one's bottom is just below the other's top, but not opposite to it.
  const Lines blocks{{{0, 4, 6, 10}, {0, 10}, {0, 3, 3.2, 6}}};
  CHECK(lines_of(block(blocks, [](int i, int, int k) { return (i == 0 && k < 2) || (i == 2 && k > 0); }), 3) ==
        Positions{0, 3, 6});
  // Three walls and two gaps, all thin, and the ends.
  const Lines stack{{{0, 1, 10}, {0, 10}, {0, 0.2, 0.4, 0.6, 0.8, 1}}};
  CHECK(lines_of(block(stack, [](int i, int, int k) { return i == 0 || k % 2 == 0; }), 2) == stack[2]);
  CHECK(lines_of(block(stack, everywhere), 2) == Positions{0, 1});
  // Too many cells.
  CHECK(lines_of(block(stack, everywhere), 0.04).empty());
}

TEST_CASE("Edges of a chamfer get lines if no cell can hold it", "[templates]") {
  const auto lines_of = [](double width, double size) {
    const TriangleMesh surface = chamfered_block(width);
    AxisPlanes planes = axis_planes(surface, Mat3::Identity());
    planes.levels = edge_levels(surface, planes.frame, planes.tolerance);
    return lines_through_planes(surface, planes, size, 1e6);
  };
  const auto holds = [](const std::vector<double>& lines, double position) {
    return std::ranges::any_of(lines, [&](double line) { return std::abs(line - position) < 1e-12; });
  };
  constexpr double kSize = 0.3;
  const Lines lines = lines_of(0.1, kSize);
  CHECK(holds(lines[0], 3.9));
  CHECK(holds(lines[1], 2.9));
  CHECK(lines[2].size() == 8);
  for (const double width : {0.02, 0.2}) {  // too thin for a layer of its own; wide enough for whole cells
    CHECK_FALSE(holds(lines_of(width, kSize)[0], 4 - width));
    CHECK_FALSE(holds(lines_of(width, kSize)[1], 3 - width));
  }
}

TEST_CASE("A thin wall between a hole and long edges gets a line", "[templates]") {
  constexpr double kSize = 0.3, kDiagonal = 5;
  const auto lines_with = [](double wall, std::vector<Vec3> turns, double length) {
    const EdgeLevel side{0, length, {{Vec3(0, 0, 0), Vec3(length, 0, 0)}}, {}}, rims{wall, 0, {}, std::move(turns)};
    std::vector<double> lines{0, 3};
    add_lines_at_levels({side, rims}, kDiagonal, 1e-5, kSize, lines);
    return lines;
  };
  using Positions = std::vector<double>;
  const std::vector<Vec3> turns{Vec3(1, 0.05, 0), Vec3(1, 0.05, 0.1)};
  CHECK(lines_with(0.05, turns, 4) == Positions{0, 0.05, 3});
  CHECK(lines_with(0.02, turns, 4) == Positions{0, 3});                         // too thin for a layer of its own
  CHECK(lines_with(0.2, turns, 4) == Positions{0, 3});                          // wide enough for whole cells
  CHECK(lines_with(0.05, turns, 1) == Positions{0, 3});                         // the edge is short
  CHECK(lines_with(0.05, {turns.front()}, 4) == Positions{0, 3});               // one curve
  CHECK(lines_with(0.05, {turns[0], Vec3(1, 0.05, 1)}, 4) == Positions{0, 3});  // the other one is far from the edge
}

TEST_CASE("Only smooth curves turn", "[templates]") {
  const auto turns_of = [](const TriangleMesh& surface) {
    std::size_t count = 0;
    for (const EdgeLevel& level : edge_levels(surface, Mat3::Identity(), 1e-6)[0]) count += level.turns.size();
    return count;
  };
  CHECK(turns_of(cylinder(50)) == 4);  // at either side of both ends
  CHECK(turns_of(box(Vec3(1, 2, 3))) == 0);
}

TEST_CASE("The cells that a chamfer cuts along their diagonals are left out, all of them", "[templates]") {
  const TriangleMesh surface = chamfered_block(0.1);
  const AutoTemplate made = made_through(surface, 500);
  CHECK(has_line(made, Vec3::UnitX(), 3.9));
  CHECK(has_line(made, Vec3::UnitY(), 2.9));
  const double whole = 4.0 * 3 * 2;
  CHECK(solid_boundary(surface_of(made.mesh)).volume == Approx(whole - 0.1 * 0.1 * 2).epsilon(1e-12));
}

TEST_CASE("A cylinder has two planes", "[templates]") {
  const TriangleMesh surface = cylinder(200);
  const AutoTemplate made = made_through(surface, 300);
  CHECK(has_line(made, Vec3::UnitZ(), -1));
  CHECK(has_line(made, Vec3::UnitZ(), 1));
  // The two ends have a third of the area; a facet of the side may lie along each axis.
  CHECK(made.aligned_share >= Approx(1.0 / 3).epsilon(1e-3));
  CHECK(made.aligned_share < 0.36);
  for (const Vec3& p : made.mesh.positions) CHECK(std::abs(p.z()) < 1 + 1e-12);
}

TEST_CASE("Parts too far apart for a grid through their planes are refused", "[templates]") {
  const TriangleMesh cube = test::cube_surface(2, false);
  for (const double apart : {1e5, 1e10}) {
    TriangleMesh two = cube;
    const auto n = static_cast<Index>(cube.positions.size());
    for (const auto& [a, b, c] : cube.triangles) two.triangles.push_back({a + n, b + n, c + n});
    for (const Vec3& p : cube.positions) two.positions.push_back(p + apart * Vec3(1, 1, 0));
    CHECK_THROWS_AS(auto_templates(two, {.cells = 50, .through_planes = true}), InputError);
  }
}

TEST_CASE("Without planes the result is that of equal grids", "[templates]") {
  const TriangleMesh ball = test::cube_surface(8, true);
  const AutoTemplateResult with = auto_templates(ball, {.cells = 60, .through_planes = true}, 2),
                           without = auto_templates(ball, {.cells = 60}, 2);
  REQUIRE(with.templates.size() == without.templates.size());
  for (std::size_t i = 0; i < with.templates.size(); ++i) {
    CHECK(with.templates[i].mesh.positions == without.templates[i].mesh.positions);
    CHECK(with.templates[i].mesh.cell_vertices == without.templates[i].mesh.cell_vertices);
    CHECK(with.templates[i].lines == Lines{});
    CHECK(with.templates[i].aligned_share == 0);
  }
  AutoTemplateOptions options{.cells = 60, .through_planes = true};
  options.progress = [](double) { return false; };
  CHECK(auto_templates(test::cube_surface(4, false), options).cancelled);
}

TEST_CASE("Grids between given lines map both ways", "[templates]") {
  const Mat3 frame = turn_of(20);
  const VoxelGrid grid = grid_through(frame, {{{-1, 0.3, 0.4, 2}, {5, 6}, {0, 0.1, 1.0 / 3}}});
  CHECK(grid.cells == std::array<int, 3>{3, 1, 2});
  for (int i = 0; i < 4; ++i) CHECK(grid.position(0, i) == grid.lines[0][static_cast<std::size_t>(i)]);
  for (const double at : {-3.0, -0.5, 0.0, 0.25, 1.0, 1.5, 2.75, 3.0, 4.5})
    CHECK(grid.coordinate(0, grid.position(0, at)) == Approx(at).margin(1e-14));
  CHECK((grid.point(1, 0.5, 2) - frame * Vec3(0.3, 5.5, 1.0 / 3)).norm() < 1e-14);
  const std::vector<double> volumes = cell_volumes(grid);
  REQUIRE(volumes.size() == grid.num_cells());
  CHECK(volumes[1] == Approx(0.1 * 1 * 0.1));
  CHECK(std::accumulate(volumes.begin(), volumes.end(), 0.0) == Approx(1));
  CHECK_THROWS_AS(grid_through(frame, {{{0, 1}, {0}, {0, 1}}}), InputError);
  CHECK_THROWS_AS(grid_through(frame, {{{0, 1}, {0, 0}, {0, 1}}}), InputError);
  CHECK_THROWS_AS(grid_through(frame, {{{0, 1}, {0, NAN}, {0, 1}}}), InputError);

  const VoxelGrid equal = box_grid(Vec3(0.1, 0.2, 0.3), Vec3(1, 2, 3), {3, 4, 5});
  CHECK(cell_volumes(equal).empty());
  CHECK(equal.point(1, 2.5, 3) == equal.origin + equal.edges * Vec3(1, 2.5, 3));
  CHECK(equal.coordinate(1, 0.37) == 0.37);
}

TEST_CASE("Solid fractions between given lines", "[templates]") {
  const TriangleMesh ball = test::cube_surface(8, true);
  const double volume = solid_boundary(ball).volume;
  const std::vector<double> even{-1.5, -0.9, -0.3, 0.3, 0.9, 1.5}, uneven{-1.5, -0.95, -0.31, 0, 0.07, 0.6, 1.5};
  const VoxelGrid equal = box_grid(Vec3::Constant(-1.5), Vec3::Constant(1.5), {5, 5, 5});
  const std::vector<double> a = solid_fractions(ball, equal),
                            b = solid_fractions(ball, grid_through(Mat3::Identity(), {even, even, even}));
  for (std::size_t c = 0; c < a.size(); ++c) CHECK(a[c] == Approx(b[c]).margin(1e-12));
  const VoxelGrid grid = grid_through(turn_of(20), {uneven, even, uneven});
  const std::vector<double> fractions = solid_fractions(ball, grid, 8), volumes = cell_volumes(grid);
  CHECK(std::inner_product(fractions.begin(), fractions.end(), volumes.begin(), 0.0) == Approx(volume).epsilon(0.005));
  // A box between lines fills its cells.
  const TriangleMesh filling =
      block({{{-0.95, 0, 0.07}, {-0.9, 0.9}, {-0.31, 0.07}}}, [](int, int, int) { return true; });
  const std::vector<double> full = solid_fractions(turned(filling, turn_of(20)), grid);
  for (std::size_t c = 0; c < full.size(); ++c) {
    const auto [i, j, k] = grid.place(static_cast<Index>(c));
    const bool inside = i >= 1 && i <= 3 && j >= 1 && j <= 3 && k >= 2 && k <= 3;
    CHECK(full[c] == Approx(inside ? 1 : 0).margin(1e-12));
  }
}

TEST_CASE("Scores weigh cells by their volumes", "[templates]") {
  VoxelSolid solid({5, 5, 5}, VertexRule::manifold);
  std::vector<double> fractions(solid.num_cells(), 0.0), volumes(solid.num_cells(), 1.0);
  const Index thick = 1 + 5 * (2 + 5 * 2), thin = thick + 1;
  solid.flip(thick);
  fractions[thick] = fractions[thin] = 1;
  CHECK(voxel_score(solid, fractions, volumes) == voxel_score(solid, fractions));
  volumes[thin] = 0.25;
  CHECK(voxel_score(solid, fractions) == Approx(0.5 + 0.5 + 0.15));
  CHECK(voxel_score(solid, fractions, volumes) == Approx(0.2 + 0.2 + 0.15));
}

TEST_CASE("Triangles without area make no levels, and hide none", "[templates]") {
  const TriangleMesh box = test::cube_surface(2, false);
  TriangleMesh cut = box;
  for (std::size_t t = 0; t < box.triangles.size(); t += 5) {  // a vertex in the middle of an edge, on one side only
    const auto [a, b, c] = box.triangles[t];
    const auto m = static_cast<Index>(cut.positions.size());
    cut.positions.push_back((box.positions[a] + box.positions[b]) / 2);
    cut.triangles[t] = {a, m, c};
    cut.triangles.push_back({m, b, c});
    cut.triangles.push_back({a, b, m});  // no area
  }
  const Mat3 turned = Eigen::AngleAxisd(0.5, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  for (const Mat3& frame : {Mat3(Mat3::Identity()), turned}) {
    const auto expected = edge_levels(box, frame, 1e-6), found = edge_levels(cut, frame, 1e-6);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      REQUIRE(found[axis].size() == expected[axis].size());
      for (std::size_t i = 0; i < found[axis].size(); ++i)
        CHECK(found[axis][i].position == Approx(expected[axis][i].position).margin(1e-9));
    }
  }
}
