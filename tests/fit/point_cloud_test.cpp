// SPDX-License-Identifier: GPL-3.0-or-later
// Points as targets: inverse fitting. Paper: figure 10.

#include "samples/shapes.h"
#include "subvol/base/error.h"
#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/fit/energies/closest_point_energy.h"
#include "subvol/fit/energies/surface_energy.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/subdivision_fit.h"
#include "subvol/fit/target/cloud_geometry.h"
#include "subvol/io/surface_io.h"
#include "tests/support/surface_fixtures.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/threads.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;
using Catch::Contains;

namespace {

PointCloud on_sphere(std::size_t n) {
  RandomPoints random(11);
  PointCloud cloud;
  while (cloud.points.size() < n) {
    const Vec3 p = random.point();
    if (p.norm() < 1 && p.norm() > 0.1) cloud.points.push_back(p.normalized());
  }
  return cloud;
}

TriangleMesh boundary_of(const HighOrderMesh& mesh) {
  const BoundarySamples samples = make_boundary_samples(mesh.space, 12);
  return {samples.positions.apply(mesh.coefficients), samples.triangles};
}

std::string ply_header(const std::string& counts) { return "ply\nformat ascii 1.0\n" + counts + "end_header\n"; }

constexpr const char* kTenPoints = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 0\n1 0 1\n0 1 1\n1 1 1\n2 0 0\n0 2 0\n";

PointCloud read(const std::string& name, const std::string& text, std::vector<std::string>* warnings = nullptr) {
  const TemporaryFolder folder;
  return read_point_cloud(folder.file(name, text), warnings);
}

}  // namespace

TEST_CASE("Neighbors tell a cloud's normals, area and volume") {
  const PointCloud cloud = on_sphere(4000);
  const CloudGeometry geometry = cloud_geometry(cloud.points);
  CHECK(geometry.area == Approx(4 * std::numbers::pi).epsilon(0.03));
  CHECK(geometry.spacing == Approx(std::sqrt(geometry.area / 4000)));
  double least = 1;
  for (std::size_t i = 0; i < cloud.points.size(); ++i)
    least = std::min(least, std::abs(geometry.normals[i].dot(cloud.points[i])));
  CHECK(least > 0.99);
  const TargetSurface target(cloud);
  CHECK(target.is_cloud());
  CHECK(target.volume_source() == VolumeSource::flood);
  CHECK(target.volume() == Approx(4 * std::numbers::pi / 3).epsilon(0.1));
  CHECK(target.samples() == cloud.points);
}

TEST_CASE("Areas are those of all distances sorted, and a point far away changes nothing for the others") {
  PointCloud cloud = on_sphere(20000);
  const CloudGeometry alone = cloud_geometry(cloud.points);
  cloud.points.push_back(Vec3(1e6, 0, 0));
  CloudGeometry beside = cloud_geometry(cloud.points);
  CHECK(beside.areas.back() > 1e10);
  beside.areas.pop_back();
  beside.normals.pop_back();
  CHECK(beside.areas == alone.areas);
  CHECK(beside.normals == alone.normals);

  std::vector<Vec3> lattice;  // many are equally far
  for (int i = 0; i < 60; ++i)
    for (int j = 0; j < 60; ++j) lattice.emplace_back(0.1 * i, 0.1 * j, 0.7);
  for (const std::vector<Vec3>& points : {on_sphere(3000).points, lattice}) {
    const CloudGeometry geometry = cloud_geometry(points);
    for (std::size_t i = 0; i < points.size(); i += 100) {
      std::vector<double> squared;
      for (const Vec3& p : points) squared.push_back((p - points[i]).squaredNorm());
      std::sort(squared.begin(), squared.end());
      CHECK(geometry.areas[i] == Approx(std::numbers::pi * squared[16] / 16).epsilon(1e-12));
    }
  }
}

TEST_CASE("By area, a dense part of a cloud weighs no more than a sparse one") {
  PointCloud cloud = on_sphere(8000);
  std::erase_if(cloud.points, [n = 0](const Vec3& p) mutable { return p.z() < 0 && n++ % 10 != 0; });
  const auto upper_share = [&](PointWeights weights) {
    const TargetSurface target(cloud, weights);
    double upper = 0;
    for (std::size_t i = 0; i < cloud.points.size(); ++i)
      if (cloud.points[i].z() > 0) upper += target.sample_areas()[i];
    return upper / target.area();
  };
  CHECK(upper_share(PointWeights::equal) == Approx(10. / 11).epsilon(0.02));
  CHECK(upper_share(PointWeights::by_area) == Approx(0.5).epsilon(0.1));
}

TEST_CASE("A cloud's geometry has the same bits for one and two threads, and refuses what has none") {
  const PointCloud cloud = on_sphere(3000);
  test::ThreadGuard guard;
  guard.use(1);
  const CloudGeometry one = cloud_geometry(cloud.points);
  guard.use(2);
  const CloudGeometry two = cloud_geometry(cloud.points);
  CHECK(one.normals == two.normals);
  CHECK(one.areas == two.areas);
  CHECK_THROWS_AS(cloud_geometry(std::vector{Vec3(0, 0, 0)}), InputError);
  CHECK_THROWS_AS(cloud_geometry(std::vector(20, Vec3(1, 2, 3))), InputError);
  CHECK_THROWS_AS(cloud_geometry(std::vector{Vec3(0, 0, 0), Vec3(NAN, 0, 0)}), InputError);
  CHECK_THROWS_AS(cloud_geometry(std::vector{Vec3(0, 0, 0), Vec3(1e-170, 0, 0)}), InputError);
  CHECK_NOTHROW(cloud_geometry(std::vector{Vec3(0, 0, 0), Vec3(1, 0, 0)}));
}

TEST_CASE("Points that rounding puts in one place have no area, and those around have theirs") {
  PointCloud cloud = on_sphere(1000);
  const double area = cloud_geometry(cloud.points).area;
  for (int k = 0; k < 300; ++k) cloud.points.push_back(Vec3(0, 0, 1));
  const CloudGeometry geometry = cloud_geometry(cloud.points);
  CHECK(geometry.area == Approx(area).epsilon(0.05));
  CHECK(*std::max_element(geometry.areas.begin() + 1000, geometry.areas.end()) == 0);

  PointCloud two_groups;
  RandomPoints random(3);
  for (int k = 0; k < 80; ++k) two_groups.points.push_back(1e-11 * random.point() + Vec3(k < 40 ? 0 : 1, 0, 0));
  CHECK(TargetSurface(two_groups).volume() > 0);
}

TEST_CASE("Points pull at the nearest places alone: value and derivatives") {
  const PointCloud cloud = on_sphere(500);
  const TargetSurface target(cloud);
  TriangleMesh fitted = cube_surface(6, true);
  RandomPoints random(4);
  for (Vec3& p : fitted.positions) p = 0.9 * p + random.point(0.03);
  const double tau = 0.2;
  ClosestPointEnergy energy(target, fitted.triangles, fitted.positions.size(), tau, 1);
  energy.assign(fitted.positions);
  double expected = 0;
  const ClosestPoint tree(fitted);
  for (std::size_t j = 0; j < cloud.points.size(); ++j) {
    const Vec3 d = tree.closest(cloud.points[j]).point - cloud.points[j];
    const double along = target.sample_normals()[j].dot(d);
    expected += target.sample_areas()[j] * (tau * d.squaredNorm() + (1 - tau) * along * along);
  }
  expected /= 2 * target.area() * target.length() * target.length();
  CHECK(energy.target_to_surface() == Approx(expected));
  CHECK(energy.surface_to_target() == 0);
  std::vector<Vec3> gradient(fitted.positions.size(), Vec3::Zero());
  energy.add_gradient(fitted.positions, gradient);
  const std::vector<Vec3> direction = random.points(fitted.positions.size());
  double slope = 0;
  for (std::size_t i = 0; i < gradient.size(); ++i) slope += gradient[i].dot(direction[i]);
  const double step = 1e-4;
  const auto moved = [&](double t) {
    std::vector<Vec3> z = fitted.positions;
    for (std::size_t i = 0; i < z.size(); ++i) z[i] += t * direction[i];
    return energy.value(z);
  };
  CHECK((moved(step) - moved(-step)) / (2 * step) == Approx(slope).epsilon(1e-5));
  CHECK_THROWS_AS(SurfaceEnergy(target, fitted.triangles, fitted.positions.size(), tau), InputError);
}

TEST_CASE("Points on a sphere and on a bumpy ball give the surfaces back, with certified cells", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  const TriangleMesh sphere = cube_surface(24, true);
  for (const TriangleMesh* surface : {&sphere, &sample.target}) {
    const PointCloud cloud = samples::scattered_points(*surface, 4000);
    const FitResult result = fit_subdivision_volume(cloud, sample.template_mesh, {.levels = 2});
    CHECK(result.report.stop_reason == StopReason::converged);
    CHECK(result.report.target.num_points == 4000);
    const MeshCheck one_sided = check_mesh(result.mesh, &cloud);
    CHECK(one_sided.valid());
    REQUIRE(one_sided.distance);
    CHECK(one_sided.distance->one_sided);
    // As near as with the surface itself, from which the chords of so few cells stand off.
    const MeshCheck from_surface =
        check_mesh(fit_subdivision_volume(*surface, sample.template_mesh, {.levels = 2}).mesh, surface);
    const MeshCheck from_points = check_mesh(result.mesh, surface);
    CHECK(one_sided.mean_distance_percent() < 1.1 * from_surface.mean_distance_percent());
    CHECK(from_points.mean_distance_percent() < 1.1 * from_surface.mean_distance_percent());
    CHECK(from_points.max_distance_percent() < 1.5 * from_surface.max_distance_percent());
  }
}

TEST_CASE("Curved elements follow points, and noise is averaged out", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  const double percent = 100 / bounding_box_diagonal(sample.target);
  for (double noise : {0.0, 0.01}) {
    CAPTURE(noise);
    const PointCloud cloud = samples::scattered_points(sample.target, 4000, noise);
    for (PointWeights weights : {PointWeights::equal, PointWeights::by_area}) {
      const HighOrderFitResult result =
          fit_high_order(cloud, sample.template_mesh, {.order = 4, .point_weights = weights});
      CHECK(result.report.stop_reason == StopReason::converged);
      CHECK(measure_quality(result.mesh).inverted_cells == 0);
      const double distance = percent * surface_distance(boundary_of(result.mesh), sample.target).mean();
      CHECK(distance < 0.1 + 0.3 * percent * noise);
    }
  }
}

TEST_CASE("Fits to points are the same bits for one and two threads, and as good far from the origin", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  const PointCloud cloud = samples::scattered_points(sample.target, 1000);
  test::ThreadGuard guard;
  std::vector<VolumeMesh> results;
  for (int n : {1, 2}) {
    guard.use(n);
    results.push_back(fit_subdivision_volume(cloud, sample.template_mesh, {.levels = 1}).mesh);
  }
  CHECK(results[0].positions == results[1].positions);
  const Vec3 far(1e4, -2e4, 3e3);
  PointCloud moved_cloud = cloud;
  VolumeMesh moved_template = sample.template_mesh;
  for (Vec3& p : moved_cloud.points) p = 3 * p + far;
  for (Vec3& p : moved_template.positions) p = 3 * p + far;
  const FitResult moved = fit_subdivision_volume(moved_cloud, moved_template, {.levels = 1});
  CHECK(check_mesh(moved.mesh, &moved_cloud).mean_distance_percent() ==
        Approx(check_mesh(results[0], &cloud).mean_distance_percent()).epsilon(0.03));
}

TEST_CASE("Half a sphere of points: cells hold the rest, and the template tells the volume") {
  const samples::Sample sample = samples::ball_sample();
  PointCloud cloud = on_sphere(3000);
  std::erase_if(cloud.points, [](const Vec3& p) { return p.z() < 0; });
  const FitResult result = fit_subdivision_volume(cloud, sample.template_mesh, {.levels = 2});
  CHECK(check_mesh(result.mesh, &cloud).valid());
  CHECK(result.report.target.volume_source == VolumeSource::given);
  CHECK(check_mesh(result.mesh, &cloud).mean_distance_percent() < 1);
}

TEST_CASE("What needs triangles is refused for points") {
  const samples::Sample sample = samples::ball_sample();
  const PointCloud cloud = samples::scattered_points(sample.target, 100);
  CHECK_THROWS_AS(fit_subdivision_volume(cloud, sample.template_mesh, {.crease_angle_degrees = 40}), InputError);
  CHECK_THROWS_AS(fit_subdivision_volume(cloud, sample.template_mesh, {.correspondence = Correspondence::voronoi}),
                  InputError);
  CHECK_THROWS_AS(fit_high_order(cloud, sample.template_mesh, {.correspondence = Correspondence::voronoi}), InputError);
  CHECK_THROWS_AS(fit_subdivision_volume(PointCloud{}, sample.template_mesh, {}), InputError);
}

TEST_CASE("Points are read from .xyz and .ply, with what else is there skipped") {
  std::vector<std::string> warnings;
  const std::string text = kTenPoints;
  CHECK(read("a.xyz", text).points.size() == 10);
  CHECK(read("a.xyz", "# a scan\n\n" + text + "\n  \n# end").points[1] == Vec3(1, 0, 0));
  CHECK(read("a.xyz", text + "5 6 7 0.1 0.2 0.3\n", &warnings).points.back() == Vec3(5, 6, 7));
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Contains("more than three columns"));
  warnings.clear();
  CHECK(read("a.xyz", text + text, &warnings).points.size() == 10);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Contains("10 points are there more than once"));
  const std::string vertices = "element vertex 10\nproperty float x\nproperty float y\nproperty float z\n";
  CHECK(read("a.ply", ply_header(vertices) + text).points.size() == 10);
  const TemporaryFolder folder;
  CHECK(is_point_cloud_file(folder.file("a.xyz", text)));
  CHECK(is_point_cloud_file(folder.file("b.ply", ply_header(vertices) + text)));
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\n";
  CHECK(!is_point_cloud_file(folder.file("c.ply", ply_header(vertices + faces) + text + "3 0 1 2\n")));
  CHECK(is_point_cloud_file(
      folder.file("d.ply", ply_header(vertices + "element face 0\nproperty list uchar int vertex_indices\n") + text)));
  CHECK(!is_point_cloud_file(folder.file("e.off", "OFF")));
}

TEST_CASE("What is malformed in a file of points is refused with its line") {
  const auto refusal = [](const std::string& name, const std::string& text) -> std::string {
    try {
      read(name, text);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  const std::string text = kTenPoints;
  CHECK_THAT(refusal("a.xyz", text + "1 2\n"), Contains("a.xyz:11:") && Contains("number 3"));
  CHECK_THAT(refusal("a.xyz", text + "1 2 x\n"), Contains(":11:") && Contains("'x'"));
  CHECK_THAT(refusal("a.xyz", text + "1 nan 2\n"), Contains(":11:") && Contains("'nan'"));
  CHECK_THAT(refusal("a.xyz", ""), Contains("no points"));
  CHECK_THAT(refusal("a.xyz", "1 2 3\n4 5 6\n"), Contains("only 2 points") && Contains("at least 10"));
  CHECK_THAT(refusal("a.xyz", "1 2 3\n1 2 3\n"), Contains("one place"));
  CHECK_THAT(refusal("a.xyz", text + "1e300 0 0\n"), Contains("1e+300"));
  CHECK_THAT(refusal("a.off", text), Contains("'.off'") && Contains(".xyz"));
  CHECK_THAT(refusal("none.ply", "ply\n"), Contains("end_header"));
}
