// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/automatic_fit.h"
#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/fit/fits/fitted_cage.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/quality/region_quality.h"
#include "subvol/fit/target/region_matching.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/templates/label_surface.h"
#include "tests/support/region_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>

using namespace subvol;
using namespace subvol::internal;
using test::ball_surface;
using test::box_surface;
using test::together;

namespace {

/// Fits regions and checks what must be true of every result.
AutomaticFitResult fitted(const RegionSurface& surface, const AutomaticFitOptions& options, double least_jacobian,
                          double volume_percent) {
  AutomaticFitResult result = fit_regions(surface, options);
  const TriangleMesh outer = outer_surface(surface);
  const MeshCheck check = check_mesh(result.mesh, &outer);
  CHECK(check.valid());
  REQUIRE(check.regions);
  const AutomaticFitTrial& best = result.trials[result.chosen];
  UNSCOPED_INFO(result.report.explanation);
  CHECK(best.least_scaled_jacobian >= least_jacobian);
  CHECK(best.volume_percent <= volume_percent);
  CHECK(best.self_intersections == std::size_t{0});
  const RegionReport wanted = measure_regions(surface), found = *check.regions;
  REQUIRE(found.regions.size() == wanted.regions.size());
  for (std::size_t r = 0; r < found.regions.size(); ++r)
    CHECK(std::abs(found.regions[r].volume / wanted.regions[r].volume - 1) <= volume_percent / 100);
  REQUIRE(found.interfaces.size() == wanted.interfaces.size());
  for (std::size_t i = 0; i < found.interfaces.size(); ++i) {
    CHECK(found.interfaces[i].references == wanted.interfaces[i].references);
    CHECK(found.interfaces[i].area == Approx(wanted.interfaces[i].area).epsilon(0.01));
  }
  return result;
}

}  // namespace

TEST_CASE("Slabs and a box in a box are filled exactly, with their interfaces in groups", "[regions]") {
  for (const TriangleMesh& target :
       {test::slabs_surface(5),
        together(box_surface({0, 0, 0}, {1, 1, 1}), box_surface({0.25, 0.25, 0.25}, {0.75, 0.75, 0.75}))}) {
    const auto surface = find_regions(target);
    REQUIRE(surface);
    AutomaticFitOptions options;
    options.cells = 600;
    const AutomaticFitResult result = fitted(*surface, options, 0.999, 1e-6);
    CHECK(result.trials[result.chosen].max_percent < 1e-6);
    CHECK(result.trials[result.chosen].within_share == Approx(1));
    CHECK(result.mesh.face_groups.groups.size() == surface->regions.size() - 1);
    CHECK(result.mesh.face_groups.groups[0].name == "region 1|region 2");
  }
}

TEST_CASE("A cage with regions has their volumes, and flat interfaces stay flat", "[regions][slow]") {
  for (const TriangleMesh& target :
       {test::slabs_surface(3), together(ball_surface({0, 0, 0}, 1, 3), ball_surface({0.1, 0, 0}, 0.5, 3))}) {
    const auto surface = find_regions(target, RegionRule::keep);
    REQUIRE(surface);
    const bool is_flat = surface->regions.size() == 3;
    const AutomaticFitResult result = fitted(
        *surface, {.cells = std::size_t(is_flat ? 4000 : 12000), .makes_cage = true}, is_flat ? 0.99 : 0.5, 1e-3);
    const AutomaticFitTrial& best = result.trials[result.chosen];
    CHECK(best.max_percent < (is_flat ? 1e-6 : 1.0));
    REQUIRE(result.cage.num_cells() * 8 == result.mesh.num_cells());
    CHECK(region_references(result.cage) == region_references(result.mesh));
    // The mesh is the one that the cage is subdivided to, with its sheets at limit positions.
    const std::vector<Vec3> again = FittedCage(result.cage).nodes();
    double difference = 0;
    for (std::size_t v = 0; v < again.size(); ++v)
      difference = std::max(difference, (again[v] - result.mesh.positions[v]).norm());
    CHECK(difference < 1e-9);
  }
}

TEST_CASE("A cage of a ball in a box follows the box's edges, and keeps both volumes", "[regions][slow]") {
  const TriangleMesh target = together(box_surface({-1, -1, -1}, {1, 1, 1}), ball_surface({0, 0, 0}, 0.6, 3));
  const auto surface = find_regions(target, RegionRule::keep);
  REQUIRE(surface);
  AutomaticFitOptions options{.makes_cage = true, .keep_states = true};
  const AutomaticFitResult result = fitted(*surface, options, 0.5, 1e-3);
  REQUIRE(result.report.creases);
  CHECK(result.report.creases->within_share() > 0.99);
  CHECK(result.mesh.face_groups.groups.size() == result.cage.face_groups.groups.size());
  REQUIRE(!result.states.empty());
  for (const FitState& state : result.states) CHECK(state.positions.size() == result.cage.num_vertices());
  options.control.progress = [](const FitProgress& progress) { return progress.fraction < 0.3; };
  const AutomaticFitResult cancelled = fit_regions(*surface, options);
  CHECK(cancelled.report.stop_reason == StopReason::cancelled);
  CHECK(cancelled.mesh.num_cells() == 8 * cancelled.cage.num_cells());
}

TEST_CASE("A ball in a box keeps the box's edges, and both volumes", "[regions][slow]") {
  const auto surface = find_regions(together(box_surface({-1, -1, -1}, {1, 1, 1}), ball_surface({0, 0, 0}, 0.6, 24)));
  REQUIRE(surface);
  AutomaticFitOptions options;
  options.cells = 6000;
  const AutomaticFitResult result = fitted(*surface, options, 0.5, 0.1);
  CHECK(result.trials[result.chosen].followed_curves == 12);
}

TEST_CASE("A layered cylinder keeps its layers", "[regions][slow]") {
  const auto surface = find_regions(test::layered_cylinder({0.5, 1}, 2, 96));
  REQUIRE(surface);
  AutomaticFitOptions options;
  options.cells = 8000;
  const AutomaticFitResult result = fitted(*surface, options, 0.6, 0.1);
  CHECK(result.trials[result.chosen].pads > 0);
}

TEST_CASE("Layers on both sides of a tilted interface end at the sides of the box", "[regions]") {
  const auto surface = find_regions(test::tilted_cut_surface(0.5));
  REQUIRE(surface);
  AutomaticFitOptions options;
  options.cells = 1500;
  const AutomaticFitResult result = fitted(*surface, options, 0.65, 1e-3);
  CHECK(result.trials[result.chosen].pads == 2);
  CHECK(result.trials[result.chosen].max_percent < 1e-3);
}

TEST_CASE("The layers around a core that is cut across go through both of its parts", "[slow][regions]") {
  const TriangleMesh lower = test::layered_cylinder({0.5, 1}, 1, 48);
  TriangleMesh upper = lower;
  for (Vec3& p : upper.positions) p.z() += 1;
  const auto surface = find_regions(together(lower, upper));
  REQUIRE(surface);
  REQUIRE(surface->regions.size() == 4);
  AutomaticFitOptions options;
  options.cells = 4000;
  fitted(*surface, options, 0.6, 0.1);
}

TEST_CASE("Nested balls with a thin skin keep their volumes", "[regions][slow]") {
  const auto surface = find_regions(together(together(ball_surface({0, 0, 0}, 1, 40), ball_surface({0, 0, 0}, 0.9, 40)),
                                             ball_surface({0.1, 0, 0}, 0.5, 24)));
  REQUIRE(surface);
  AutomaticFitOptions options;
  options.cells = 30000;
  fitted(*surface, options, 0.4, 0.1);
}

TEST_CASE("A segmented phantom is filled with all of its regions, half a voxel or less from the truth",
          "[regions][slow]") {
  const test::Phantom phantom{64};
  const LabelGrid grid = phantom.grid();
  std::vector<double> voxels(5, 0.0);
  for (const int label : grid.labels) voxels[static_cast<std::size_t>(label)] += 1;
  const RegionSurface surface = surface_of_labels(grid);
  AutomaticFitOptions options;
  options.cells = 20000;
  const AutomaticFitResult result = fitted(surface, options, 0.3, 0.1);
  const std::vector<double> volumes = region_volumes(result.mesh);
  REQUIRE(volumes.size() == 4);
  for (std::size_t r = 0; r < 4; ++r) CHECK(volumes[r] == Approx(voxels[r + 1]).epsilon(0.005));
  const MeshTopology topology(result.mesh);
  std::array<double, 4> sum{}, count{};
  const auto add = [&](std::span<const Index> face, int shape) {
    for (const Index v : face) {
      sum[static_cast<std::size_t>(shape)] += phantom.distance(result.mesh.positions[v], shape);
      count[static_cast<std::size_t>(shape)] += 1;
    }
  };
  for (const Index f : topology.boundary_faces()) add(topology.face(f), 0);
  const Interfaces interfaces = find_interfaces(result.mesh, topology);
  for (std::size_t i = 0; i < interfaces.faces.size(); ++i)
    add(topology.face(interfaces.faces[i]), interfaces.pairs[interfaces.pair_of_face[i]][1] - 1);
  for (std::size_t s = 0; s < 4; ++s) CHECK(sum[s] / count[s] < 0.5);
}

TEST_CASE("Curved cells follow the interfaces of a target with regions, whatever the template's references are",
          "[regions][slow]") {
  const TriangleMesh target = together(box_surface({-1, -1, -1}, {1, 1, 1}), ball_surface({0, 0, 0}, 0.6, 24));
  const auto surface = find_regions(target);
  REQUIRE(surface);
  AutomaticFitOptions options;
  options.cells = 400;
  VolumeMesh start = fit_regions(*surface, options).mesh;
  for (int& reference : start.references) reference = 10 - reference;
  const auto matched = regions_as_in(target, start);
  REQUIRE(matched);
  CHECK(matched->regions.front().number == 8);
  CHECK(matched->volumes.front() == Approx(surface->volumes[1]));
  const HighOrderFitResult fit = fit_high_order(target, start, {.order = 2, .basis = Basis::legendre});
  CHECK(measure_quality(fit.mesh).certificate.not_certified.empty());
  const Interfaces interfaces = find_interfaces(start, MeshTopology(start));
  const BoundarySamples samples = make_face_samples(fit.mesh.space, interfaces.faces, 4);
  for (const Vec3& p : samples.positions.apply(fit.mesh.coefficients)) CHECK(p.norm() == Approx(0.6).epsilon(0.03));

  // Curved cells that are drawn to a surface without regions keep their interfaces, as curved as they are.
  const HighOrderFitResult drawn =
      fit_high_order(box_surface({-1, -1, -1}, {1, 1, 1.2}), fit.mesh, start, {.order = 2});
  CHECK(measure_quality(drawn.mesh).certificate.not_certified.empty());
  for (const Vec3& p : samples.positions.apply(drawn.mesh.coefficients)) CHECK(p.norm() == Approx(0.6).epsilon(0.03));
  for (int& reference : start.references) reference = 8;
  CHECK(!regions_as_in(target, start));
}
