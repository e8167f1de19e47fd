// SPDX-License-Identifier: GPL-3.0-or-later
// Targets as they come: torn, turned, doubled, holed, noisy. Paper: figure 9.

#include "samples/shapes.h"
#include "subvol/fit/certificate/certificate.h"
#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/fit/energies/closest_point_energy.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/subdivision_fit.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <functional>
#include <string>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

constexpr double kNoise = 0.004;  // of the ball's radius

void tear(TriangleMesh& mesh) {
  TriangleMesh soup;
  for (const auto& t : mesh.triangles) {
    const auto v = static_cast<Index>(soup.positions.size());
    for (Index corner : t) soup.positions.push_back(mesh.positions[corner]);
    soup.triangles.push_back({v, v + 1, v + 2});
  }
  mesh = std::move(soup);
}

/// Holes, as where a scanner does not see.
void pierce(TriangleMesh& mesh) {
  const Vec3 centers[] = {Vec3(1, 0.2, 0), Vec3(-0.3, 1, 0.4), Vec3(0, -0.5, -1)};
  std::erase_if(mesh.triangles, [&](const std::array<Index, 3>& t) {
    return std::any_of(std::begin(centers), std::end(centers), [&](const Vec3& center) {
      return mesh.positions[t[0]].normalized().dot(center.normalized()) > 0.97;
    });
  });
}

void flip(TriangleMesh& mesh) {
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 5) std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
}

void repeat(TriangleMesh& mesh) {
  const std::size_t n = mesh.triangles.size();
  for (std::size_t t = 0; t < n; t += 8) mesh.triangles.push_back(mesh.triangles[t]);
}

/// Slivers, needles and points in place of some triangles, and dense fans in place of others.
void make_uneven(TriangleMesh& mesh) {
  const std::size_t n = mesh.triangles.size();
  for (std::size_t t = 0; t < n; t += 3) {
    const auto corners = mesh.triangles[t];
    const auto middle = static_cast<Index>(mesh.positions.size());
    mesh.positions.push_back(mesh.positions[corners[0]] +
                             1e-9 * (mesh.positions[corners[1]] - mesh.positions[corners[0]]));
    mesh.triangles[t] = {middle, corners[1], corners[2]};
    mesh.triangles.push_back({corners[0], middle, corners[2]});
    mesh.triangles.push_back({corners[0], corners[0], corners[1]});
    mesh.triangles.push_back({middle, corners[0], corners[0]});
  }
  for (std::size_t t = 0; t < n / 4; ++t) {
    const auto corners = mesh.triangles[t];
    const auto middle = static_cast<Index>(mesh.positions.size());
    mesh.positions.push_back((mesh.positions[corners[0]] + mesh.positions[corners[1]] + mesh.positions[corners[2]]) /
                             3);
    mesh.triangles[t] = {corners[0], corners[1], middle};
    mesh.triangles.push_back({corners[1], corners[2], middle});
    mesh.triangles.push_back({corners[2], corners[0], middle});
  }
}

/// Small triangles that stand on edges of the surface.
void add_fins(TriangleMesh& mesh) {
  const std::size_t n = mesh.triangles.size();
  for (std::size_t t = 0; t < n; t += 97) {
    const auto corners = mesh.triangles[t];
    const auto tip = static_cast<Index>(mesh.positions.size());
    mesh.positions.push_back(1.004 * mesh.positions[corners[0]]);
    mesh.triangles.push_back({corners[0], corners[1], tip});
  }
}

void add_far_vertices(TriangleMesh& mesh) {
  for (int i = 0; i < 20; ++i) mesh.positions.push_back(Vec3(50 + i, -70, 3 * i));
}

void shake(TriangleMesh& mesh) {
  RandomPoints random(5);
  for (Vec3& p : mesh.positions) p += random.point(kNoise);
}

struct Damage {
  const char* name;
  std::function<void(TriangleMesh&)> apply;
  double allowance = 0;  ///< beyond twice the clean fit's distance, by the diagonal
};

/// The ball's diagonal is about 3.5 radii.
const Damage kDamages[] = {{"soup", tear},
                           {"flips", flip},
                           {"duplicates", repeat},
                           {"uneven", make_uneven},
                           {"fins", add_fins},
                           {"holes", pierce},
                           {"far vertices", add_far_vertices},
                           {"noise", shake, kNoise / 3.5}};

bool has(const std::vector<std::string>& warnings, const std::string& words) {
  return std::any_of(warnings.begin(), warnings.end(),
                     [&](const std::string& w) { return w.find(words) != std::string::npos; });
}

}  // namespace

TEST_CASE("A damaged target is fitted nearly as well as a clean one, with certified cells", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  const FitOptions options{.levels = 1, .quality = 0, .control = {.max_iterations = 6}};
  const double clean =
      check_mesh(fit_subdivision_volume(sample.target, sample.template_mesh, options).mesh, &sample.target)
          .mean_distance_percent();
  for (const Damage& damage : kDamages) {
    CAPTURE(damage.name);
    TriangleMesh target = sample.target;
    damage.apply(target);
    const FitResult result = fit_subdivision_volume(target, sample.template_mesh, options);
    const MeshCheck check = check_mesh(result.mesh, &sample.target);
    CHECK(check.valid());
    CHECK(check.mean_distance_percent() < 2 * clean + 100 * damage.allowance);
  }
}

TEST_CASE("Curved elements are fitted to damaged targets as well", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  const HighOrderFitOptions options{.order = 2, .control = {.max_iterations = 6}};
  const auto distance = [&](const TriangleMesh& target) {
    const HighOrderMesh mesh = fit_high_order(target, sample.template_mesh, options).mesh;
    CHECK(measure_quality(mesh).inverted_cells == 0);
    const BoundarySamples samples = make_boundary_samples(mesh.space, 12);
    const TriangleMesh boundary{samples.positions.apply(mesh.coefficients), samples.triangles};
    return 100 * surface_distance(boundary, sample.target).mean() / bounding_box_diagonal(sample.target);
  };
  const double clean = distance(sample.target);
  for (const Damage& damage : kDamages) {
    CAPTURE(damage.name);
    TriangleMesh target = sample.target;
    damage.apply(target);
    CHECK(distance(target) < 2 * clean + 100 * damage.allowance);
  }
}

TEST_CASE("What is odd about a target is said, what does not matter to it is not", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  const auto warnings = [&](void (*apply)(TriangleMesh&)) {
    TriangleMesh target = sample.target;
    apply(target);
    return fit_subdivision_volume(target, sample.template_mesh, {.levels = 1, .control = {.max_iterations = 1}})
        .report.warnings;
  };
  CHECK(!has(warnings([](TriangleMesh&) {}), "target: "));
  CHECK(!has(warnings(tear), "target: "));
  CHECK(!has(warnings(add_far_vertices), "target: "));
  CHECK(has(warnings(flip), "disagree about what is outside"));
  CHECK(has(warnings(pierce), "open edges"));
  CHECK(has(warnings(repeat), "edges of three triangles or more"));
  CHECK(has(warnings(add_fins), "edges of three triangles or more"));
}

TEST_CASE("A template of another topology than its target's is warned of where the target is closed", "[slow]") {
  const samples::Sample ball = samples::ball_sample(), torus = samples::torus_sample();
  const auto report = [](const TriangleMesh& target, const VolumeMesh& mesh) {
    return fit_subdivision_volume(target, mesh, {.levels = 1, .control = {.max_iterations = 1}}).report;
  };
  const FitReport other = report(torus.target, ball.template_mesh);
  CHECK(has(other.warnings, "topology differs"));
  REQUIRE(other.target.topology);
  CHECK(other.target.topology->handles == 1);
  REQUIRE(other.target.template_topology);
  CHECK(other.target.template_topology->handles == 0);
  TriangleMesh turned = torus.target;
  flip(turned);
  CHECK(has(report(turned, ball.template_mesh).warnings, "topology differs"));
  const FitReport same = report(turned, torus.template_mesh);
  CHECK(!has(same.warnings, "topology differs"));
  CHECK(same.target.same_topology());
  TriangleMesh open = torus.target;
  open.triangles.pop_back();
  const FitReport unknown = report(open, ball.template_mesh);
  CHECK(!has(unknown.warnings, "topology differs"));
  CHECK(!unknown.target.topology);
  TriangleMesh two = ball.target;
  const auto shift = static_cast<Index>(two.positions.size());
  for (const Vec3& p : ball.target.positions) two.positions.push_back(p + Vec3(5, 0, 0));
  for (auto t : ball.target.triangles) two.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  CHECK(has(report(two, ball.template_mesh).warnings, "2 components"));
}

TEST_CASE("Over a hole the fitted surface is drawn to what continues the target, and where it turns away not at all") {
  TriangleMesh target = cube_surface(4, false);
  std::erase_if(target.triangles, [&](const std::array<Index, 3>& t) {
    return std::all_of(t.begin(), t.end(), [&](Index v) { return target.positions[v].z() == 1; });
  });
  const TargetSurface surface(target);
  TriangleMesh fitted = cube_surface(8, false);
  ClosestPointEnergy energy(surface, fitted.triangles, fitted.positions.size(), 1, 3);
  energy.assign(fitted.positions);
  std::vector<Vec3> gradient(fitted.positions.size(), Vec3::Zero());
  energy.add_gradient(fitted.positions, gradient);
  int over_hole = 0;
  for (std::size_t i = 0; i < gradient.size(); ++i) {
    const Vec3& p = fitted.positions[i];
    if (p.z() < 1) continue;
    ++over_hole;
    CHECK(gradient[i].norm() < 1e-12);
  }
  CHECK(over_hole == 81);
  CHECK(energy.assigned_distance().max < 1e-12);

  // A sheet with a hole, and one without above it.
  TriangleMesh sheet, lid;
  for (int j = 0; j <= 10; ++j)
    for (int i = 0; i <= 10; ++i) sheet.positions.emplace_back(0.1 * i, 0.1 * j, 0);
  for (Index j = 0; j < 10; ++j)
    for (Index i = 0; i < 10; ++i) {
      const Index a = 11 * j + i;
      lid.triangles.insert(lid.triangles.end(), {{a, a + 1, a + 12}, {a, a + 12, a + 11}});
      if (i < 4 || i > 5 || j < 4 || j > 5)
        sheet.triangles.insert(sheet.triangles.end(), {{a, a + 1, a + 12}, {a, a + 12, a + 11}});
    }
  lid.positions = sheet.positions;
  for (Vec3& p : lid.positions) p.z() = 0.01;
  const TargetSurface open_sheet(sheet);
  ClosestPointEnergy above(open_sheet, lid.triangles, lid.positions.size(), 0.5, 3);
  above.assign(lid.positions);
  gradient.assign(lid.positions.size(), Vec3::Zero());
  above.add_gradient(lid.positions, gradient);
  const Vec3& middle = gradient[60];
  CHECK(middle.z() > 0);
  CHECK(std::hypot(middle.x(), middle.y()) < 1e-6 * middle.z());
}
