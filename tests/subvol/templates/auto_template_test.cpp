// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/auto_template.h"
#include "samples/shapes.h"
#include "subvol/base/error.h"
#include "subvol/io/surface_io.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/validate.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/solid_topology.h"
#include "subvol/templates/solid_fraction.h"
#include "subvol/templates/template_frames.h"
#include "tests/support/require_data.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/surface_fixtures.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include <functional>
#include <limits>
#include <numbers>

using namespace subvol;
using namespace subvol::internal;

namespace {

TriangleMesh boundary_of(const VolumeMesh& mesh) { return triangulate(boundary_surface(mesh, MeshTopology(mesh))); }

/// The boundary of cubes on a lattice, turned so that no grid agrees with it.
TriangleMesh voxel_surface(int nx, int ny, int nz, const std::function<bool(int, int, int)>& keep) {
  TriangleMesh surface = boundary_of(test::voxels(nx, ny, nz, keep));
  const Mat3 turn = Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  for (Vec3& p : surface.positions) p = turn * p + Vec3(0.1, 0.2, 0.3);
  return surface;
}

TriangleMesh hollow_ball() {
  TriangleMesh surface = test::cube_surface(8, true);
  const auto first = static_cast<Index>(surface.positions.size());
  const TriangleMesh inner = test::cube_surface(8, true);
  for (const Vec3& p : inner.positions) surface.positions.push_back(0.5 * p);
  for (const auto& t : inner.triangles) surface.triangles.push_back({first + t[0], first + t[2], first + t[1]});
  return surface;
}

TriangleMesh double_torus() {
  return voxel_surface(
      7, 4, 1, [](int i, int j, int) { return !((i == 1 || i == 2 || i == 4 || i == 5) && (j == 1 || j == 2)); });
}

TriangleMesh comb() {
  return voxel_surface(9, 6, 1, [](int i, int j, int) { return j == 0 || i % 2 == 0; });
}

void check_template(const AutoTemplate& made, const BettiNumbers& wanted, std::size_t cells) {
  for (const MeshDefect& defect : validate(made.mesh)) FAIL_CHECK(defect.message);
  const SolidBoundary solid = solid_boundary(boundary_of(made.mesh));
  CHECK(solid.topology == wanted);
  CHECK(made.cells_asked == cells);
  CHECK(made.mesh.num_cells() >= kLeastCellShare * static_cast<double>(cells));
  CHECK(made.mesh.num_cells() <= kMostCellShare * static_cast<double>(cells));
  for (std::size_t c = 0; c < made.mesh.num_cells(); ++c)
    CHECK(test::min_scaled_jacobian(made.mesh, c) > (made.pillowed ? 0.15 : 0.999));
}

}  // namespace

TEST_CASE("The topology of solids is read off their boundaries", "[templates]") {
  CHECK(solid_boundary(test::cube_surface(4, true)).topology == BettiNumbers{1, 0, 0});
  CHECK(solid_boundary(samples::torus_sample().target).topology == BettiNumbers{1, 1, 0});
  CHECK(solid_boundary(double_torus()).topology == BettiNumbers{1, 2, 0});
  const SolidBoundary hollow = solid_boundary(hollow_ball());
  CHECK(hollow.topology == BettiNumbers{1, 0, 1});
  const TriangleMesh ball = test::cube_surface(8, true);
  CHECK(hollow.volume == Approx(solid_boundary(ball).volume * (1 - 0.125)));
}

TEST_CASE("A soup with holes and flipped triangles becomes a solid's boundary", "[templates]") {
  const TriangleMesh ball = test::cube_surface(8, true);
  TriangleMesh soup;
  for (std::size_t t = 0; t < ball.triangles.size(); ++t) {
    if (t == 17 || t == 101) continue;  // holes
    for (Index v : ball.triangles[t]) soup.positions.push_back(ball.positions[v]);
    const auto v = static_cast<Index>(soup.positions.size());
    std::array<Index, 3> corners{v - 3, v - 2, v - 1};
    if (t % 5 == 0) std::swap(corners[0], corners[1]);
    soup.triangles.push_back(corners);
  }
  const SolidBoundary solid = solid_boundary(soup);
  CHECK(solid.topology == BettiNumbers{1, 0, 0});
  CHECK(solid.closed_holes == 2);
  CHECK(solid.flipped_triangles > 50);
  CHECK(solid.volume == Approx(solid_boundary(ball).volume).epsilon(0.01));

  CHECK_THROWS_AS(solid_boundary({}), InputError);
  TriangleMesh fan;  // three triangles at one edge
  fan.positions = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(0, -1, 0)};
  fan.triangles = {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}};
  CHECK_THROWS_AS(solid_boundary(fan), InputError);
  // Numbers are those of the input, though vertices are welded, and come in another order in the triangles.
  fan.positions = {Vec3(9, 9, 9), Vec3(0, 0, 1), Vec3(0, -1, 0), Vec3(0, 0.5, 0),
                   Vec3(1, 0, 0), Vec3(0, 0, 0), Vec3(1, 0, 0)};
  fan.triangles = {{5, 4, 3}, {6, 5, 1}, {5, 4, 2}};
  CHECK_THROWS_WITH(solid_boundary(fan), Catch::Contains("1 edge has more than two") && Catch::Contains("4 (1 0 0)") &&
                                             Catch::Contains("5 (0 0 0)") && Catch::Contains("has 3"));
  TriangleMesh fans;  // a dozen of them
  for (Index i = 0; i < 12; ++i) {
    for (const Vec3& p : fan.positions) fans.positions.push_back(p + Vec3(0, 0, 5 * i));
    for (const auto& [a, b, c] : fan.triangles) fans.triangles.push_back({7 * i + a, 7 * i + b, 7 * i + c});
  }
  CHECK_THROWS_WITH(solid_boundary(fans), Catch::Contains("12 edges have more than two faces, the first 10:") &&
                                              Catch::Contains("(1 0 45)") && !Catch::Contains("(1 0 50)"));
  CHECK_THROWS_AS(solid_boundary({{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)}, {{0, 1, 2}}}), InputError);
}

TEST_CASE("Of many parts, those that lie in an odd number of others are cavities", "[templates][slow]") {
  test::RandomPoints random(5);
  TriangleMesh surface;
  struct Part {
    Vec3 center;
    double size;
    int norm;  // the part holds the points whose distance in this norm is below its size: 1, or 0 for the largest of
               // three coordinates; -1: it holds nothing
    Eigen::AlignedBox3d box;
    std::vector<Vec3> points;  // its vertices and the centers of its triangles
    bool holds(const Vec3& p) const {
      const Vec3 d = (p - center).cwiseAbs();
      return norm >= 0 && (norm == 1 ? d.sum() : d.maxCoeff()) < (1 + 1e-9) * size;
    }
  };
  std::vector<Part> parts;
  const auto add = [&](TriangleMesh part, const Vec3& center, double size, bool inside_out) {
    const auto first = static_cast<Index>(surface.positions.size());
    const int norm = part.triangles.size() == 2 ? -1 : part.triangles.size() == 8 ? 1 : 0;
    for (Vec3& p : part.positions) p = center + size * p;
    parts.push_back({center, size, norm, {}, part.positions});
    for (const Vec3& p : part.positions) parts.back().box.extend(p);
    for (const auto& [a, b, c] : part.triangles)
      parts.back().points.push_back((part.positions[a] + part.positions[b] + part.positions[c]) / 3);
    surface.positions.insert(surface.positions.end(), part.positions.begin(), part.positions.end());
    for (const auto& t : part.triangles)
      surface.triangles.push_back({first + t[0], first + t[inside_out ? 2 : 1], first + t[inside_out ? 1 : 2]});
  };
  const TriangleMesh cube = test::cube_surface(1, false);
  const TriangleMesh octahedron{
      {-Vec3::UnitX(), Vec3::UnitX(), -Vec3::UnitY(), Vec3::UnitY(), -Vec3::UnitZ(), Vec3::UnitZ()},
      {{1, 3, 5}, {3, 0, 5}, {0, 2, 5}, {2, 1, 5}, {3, 1, 4}, {0, 3, 4}, {2, 0, 4}, {1, 2, 4}}};
  // In the plane of the first vertex, a square encloses exactly nothing. (A triangle alone would be dropped.)
  const TriangleMesh flat{{Vec3(-1, -1, 0), Vec3(1, -1, 0), Vec3(1, 1, 0), Vec3(-1, 1, 0)}, {{0, 1, 2}, {0, 2, 3}}};
  add(cube, Vec3(0, 0, 0.25), 0.25, false);
  for (int i = 0; i < 1500; ++i)
    add(i % 3 == 0 ? octahedron : cube, random.point(), std::pow(10, random.number(-4, -0.7)), random.number() < -0.2);
  add(cube, Vec3(9, 0, 0), 2, false);
  add(octahedron, Vec3(9, 0, 0), 2, true);
  add(flat, Vec3(0.1, 0, 0), 0.1, true);
  add(flat, Vec3(0, 9, 0), 0.1, true);

  int cavities = 0;
  for (const Part& part : parts) {
    std::ptrdiff_t depth = std::ssize(parts);  // a part that crosses another does not lie in it
    for (const Vec3& p : part.points)
      depth = std::min(
          depth, std::ranges::count_if(parts, [&](const Part& other) { return &other != &part && other.holds(p); }));
    // One that lies in two others together, but in neither, lies in none.
    const auto around =
        std::ranges::any_of(parts, [&](const Part& other) { return &other != &part && other.box.contains(part.box); });
    cavities += around && depth % 2 != 0;
  }
  const SolidBoundary solid = solid_boundary(surface);
  CHECK(solid.topology.cavities == cavities);
  CHECK(solid.topology.components == static_cast<int>(parts.size()) - cavities);
  CHECK(solid.closed_holes == 2);
  CHECK(cavities > 100);
  CHECK(solid.topology.components > 900);
}

TEST_CASE("A triangle without a neighbor is no part of a solid and no void in it", "[templates]") {
  const TriangleMesh cube = test::cube_surface(4, false);
  for (const double place : {0.1, 5.0}) {  // inside and outside
    TriangleMesh stray = cube;
    for (const Vec3& corner : {Vec3(0, 0, 0), Vec3(0.1, 0, 0), Vec3(0, 0.1, 0)})
      stray.positions.push_back(corner + Vec3::Constant(place));
    const auto first = static_cast<Index>(cube.positions.size());
    stray.triangles.insert(stray.triangles.begin() + 7, {first, first + 1, first + 2});
    const SolidBoundary solid = solid_boundary(stray);
    CHECK(solid.topology == BettiNumbers{1, 0, 0});
    CHECK(solid.dropped_triangles == 1);
    CHECK(solid.closed_holes == 0);
    CHECK(solid.surface.triangles.size() == cube.triangles.size());
    CHECK(solid.volume == solid_boundary(cube).volume);
  }
}

TEST_CASE("Holes that meet at one vertex are closed each by itself, however many", "[templates][slow]") {
  // A cone of which every second triangle at the top is missing.
  constexpr Index kHoles = 200000;
  TriangleMesh cone;
  cone.positions.push_back(Vec3(0, 0, 0));
  for (Index i = 0; i < 2 * kHoles; ++i) {
    const double angle = std::numbers::pi * i / kHoles;
    cone.positions.push_back(Vec3(std::cos(angle), std::sin(angle), 0));
    cone.triangles.push_back({i + 1, 0, i + 1 < 2 * kHoles ? i + 2 : 1});
  }
  cone.positions.push_back(Vec3(0, 0, 1));
  for (Index i = 0; i < 2 * kHoles; i += 2) cone.triangles.push_back({2 * kHoles + 1, i + 1, i + 2});
  const SolidBoundary solid = solid_boundary(cone);
  CHECK(solid.topology == BettiNumbers{1, 0, 0});
  CHECK(solid.closed_holes == kHoles);
  CHECK(solid.surface.triangles.size() == cone.triangles.size() + 3 * kHoles);
  CHECK(solid.volume == Approx(std::numbers::pi / 3));
}

TEST_CASE("Solid fractions add up to the volume and agree with counting points", "[templates]") {
  const TriangleMesh surface = double_torus();
  const VoxelGrid grid = box_grid(Vec3::Constant(-8), Vec3::Constant(8), {20, 20, 20});
  const std::vector<double> fractions = solid_fractions(surface, grid, 4);
  double sum = 0;
  for (double f : fractions) {
    CHECK(f >= 0);
    CHECK(f <= 1);
    sum += f;
  }
  CHECK(sum * std::pow(0.8, 3) == Approx(solid_boundary(surface).volume).epsilon(0.02));
  const std::vector<double> outside =
      solid_fractions(surface, box_grid(Vec3::Constant(20), Vec3::Constant(21), {2, 2, 2}));
  CHECK(*std::max_element(outside.begin(), outside.end()) == 0);
}

TEST_CASE("Frames follow the faces of a turned box", "[templates]") {
  const TriangleMesh box = voxel_surface(5, 3, 1, [](int, int, int) { return true; });
  const Mat3 turn = Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  double best = 0;
  for (const Mat3& frame : template_frames(box)) {
    CHECK(frame.determinant() == Approx(1));
    best = std::max(best, (frame.transpose() * turn).cwiseAbs().colwise().maxCoeff().minCoeff());
  }
  CHECK(best > 0.9999);
}

TEST_CASE("Automatic templates have the topology of their target", "[templates]") {
  struct Case {
    const char* name;
    TriangleMesh surface;
    BettiNumbers topology;
    std::size_t cells;
  };
  const Case cases[] = {
      {"ball", test::cube_surface(8, true), {1, 0, 0}, 60},
      {"torus", samples::torus_sample().target, {1, 1, 0}, 100},
      {"double torus", double_torus(), {1, 2, 0}, 150},
      {"hollow ball", hollow_ball(), {1, 0, 1}, 300},
      {"thin plate", voxel_surface(12, 12, 1, [](int, int, int) { return true; }), {1, 0, 0}, 150},
      {"comb", comb(), {1, 0, 0}, 150},
  };
  for (const Case& c : cases) {
    INFO(c.name);
    const AutoTemplateResult result = auto_templates(c.surface, {.cells = c.cells}, 2);
    REQUIRE(!result.templates.empty());
    CHECK(result.wanted == c.topology);
    for (const AutoTemplate& made : result.templates) check_template(made, c.topology, c.cells);
  }
}

TEST_CASE("Pillowed templates count their layer and have good cells", "[templates]") {
  const AutoTemplateResult result = auto_templates(test::cube_surface(8, true), {.cells = 300, .pillow = true});
  REQUIRE(!result.templates.empty());
  check_template(result.templates.front(), {1, 0, 0}, 300);
}

TEST_CASE("Where a count cannot carry the topology, one that can is named", "[templates]") {
  const AutoTemplateResult result = auto_templates(hollow_ball(), {.cells = 8});
  REQUIRE(!result.templates.empty());
  CHECK(result.templates.front().cells_asked > 8);
  check_template(result.templates.front(), {1, 0, 1}, result.templates.front().cells_asked);
}

TEST_CASE("Parts that are too far apart for a grid are refused") {
  const TriangleMesh cube = voxel_surface(1, 1, 1, [](int, int, int) { return true; });
  for (const double apart : {3000.0, 1e10}) {
    TriangleMesh two = cube;
    for (const auto& [a, b, c] : cube.triangles) {
      const auto n = static_cast<Index>(cube.positions.size());
      two.triangles.push_back({a + n, b + n, c + n});
    }
    for (const Vec3& p : cube.positions) two.positions.push_back(p + apart * Vec3(1, 1, 0));
    CHECK_THROWS_AS(auto_templates(two, {.cells = 50}), InputError);
  }
}

TEST_CASE("Positions of no triangle may be anything", "[templates]") {
  TriangleMesh cube = voxel_surface(1, 1, 1, [](int, int, int) { return true; });
  const double volume = solid_boundary(cube).volume;
  cube.positions.resize(cube.positions.size() + 40, Vec3::Constant(std::numeric_limits<double>::quiet_NaN()));
  CHECK(solid_boundary(cube).volume == volume);
}

TEST_CASE("Automatic templates do not depend on chance, and can be cancelled", "[templates]") {
  const AutoTemplateResult a = auto_templates(comb(), {.cells = 100}), b = auto_templates(comb(), {.cells = 100});
  REQUIRE(!a.templates.empty());
  CHECK(a.templates.front().mesh.positions == b.templates.front().mesh.positions);
  CHECK(a.templates.front().mesh.cell_vertices == b.templates.front().mesh.cell_vertices);
  AutoTemplateOptions options{.cells = 100};
  options.progress = [](double) { return false; };
  CHECK(auto_templates(comb(), options).cancelled);
  CHECK_THROWS_AS(auto_templates(comb(), {.cells = 1}), InputError);
  CHECK_THROWS_AS(auto_templates(comb(), {.cells = 100}, 0), InputError);
}

TEST_CASE("Real targets get templates of their topology", "[slow][templates][data]") {
  const auto folder = test::require_data();
  if (!folder) return;
  for (const char* name : {"rod59", "hanger139", "far_asm122"}) {
    INFO(name);
    const TriangleMesh target = read_triangle_mesh(*folder / "fit" / name / "target.off");
    const AutoTemplateResult result = auto_templates(target, {.cells = 200});
    REQUIRE(!result.templates.empty());
    check_template(result.templates.front(), result.wanted, 200);
  }
}
