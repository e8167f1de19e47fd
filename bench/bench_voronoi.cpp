// SPDX-License-Identifier: GPL-3.0-or-later
// Restricted Voronoi diagram: nanoseconds per pair (triangle, cell) with sites near the target and far from it, both
// ways. The target is a bumpy sphere; times are those of the process's processors, so with one thread other jobs
// disturb little.
#include "subvol/fit/geometry/restricted_voronoi.h"
#include "subvol/surface/triangle_mesh.h"

#include <omp.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <iomanip>
#include <map>
#include <numeric>
#include <random>
#include <string>

using namespace subvol;
using namespace subvol::internal;

namespace {

double processor_seconds() {
  std::timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// A cube's sides with n x n squares each, pushed to a sphere with bumps of the given height.
TriangleMesh bumpy_sphere(int n, double bumps) {
  TriangleMesh mesh;
  std::map<std::array<int, 3>, Index> numbers;
  for (int side = 0; side < 6; ++side)
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        Index v[4];
        for (int k = 0; k < 4; ++k) {
          std::array<int, 3> at{};
          at[side % 3] = side < 3 ? n : 0;
          at[(side + 1) % 3] = i + k % 2;
          at[(side + 2) % 3] = j + k / 2;
          const auto [it, added] = numbers.try_emplace(at, static_cast<Index>(mesh.positions.size()));
          v[k] = it->second;
          if (!added) continue;
          const Vec3 p = (2.0 / n * Vec3(at[0], at[1], at[2]) - Vec3::Ones()).normalized();
          mesh.positions.push_back((1 + bumps * std::sin(9 * p[0]) * std::cos(7 * p[1] + 3 * p[2])) * p);
        }
        mesh.triangles.push_back({v[0], v[1], v[3]});
        mesh.triangles.push_back({v[0], v[3], v[2]});
      }
  return mesh;
}

/// Double of a triangle's area.
double double_area(const TriangleMesh& mesh, const std::array<Index, 3>& t) {
  const Vec3 p = mesh.positions[t[0]];
  return (mesh.positions[t[1]] - p).cross(mesh.positions[t[2]] - p).norm();
}

/// Every site goes to the centroid of its cell (one step of Lloyd's algorithm); sites without a cell stay.
void relax(const TriangleMesh& mesh, std::vector<Vec3>& sites) {
  std::vector<Vec3> moments(sites.size(), Vec3::Zero());
  std::vector<double> areas(sites.size(), 0.0);
  for (const VoronoiPiece& piece : RestrictedVoronoi(sites).compute(mesh.positions, mesh.triangles)) {
    const auto& t = mesh.triangles[piece.triangle];
    const double area = double_area(mesh, t);
    for (int i = 0; i < 3; ++i) moments[piece.site] += area * piece.first_moment(i) * mesh.positions[t[i]];
    areas[piece.site] += area * piece.share();
  }
  for (std::size_t i = 0; i < sites.size(); ++i)
    if (areas[i] > 0) sites[i] = moments[i] / areas[i];
}

/// Random points of the target, uniform by area, relaxed once, then off it by a tenth of their spacing.
std::vector<Vec3> sites_near(const TriangleMesh& mesh, std::size_t n) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  std::vector<double> areas;
  for (const auto& t : mesh.triangles) areas.push_back(double_area(mesh, t) / 2);
  std::discrete_distribution<std::size_t> triangle(areas.begin(), areas.end());
  std::vector<Vec3> sites(n);
  for (Vec3& s : sites) {
    const auto& t = mesh.triangles[triangle(generator)];
    const double a = std::sqrt(uniform(generator)), b = uniform(generator);
    s = (1 - a) * mesh.positions[t[0]] + a * (1 - b) * mesh.positions[t[1]] + a * b * mesh.positions[t[2]];
  }
  relax(mesh, sites);
  const double spacing = std::sqrt(std::accumulate(areas.begin(), areas.end(), 0.0) / static_cast<double>(n));
  for (Vec3& s : sites) s += 0.1 * spacing * Vec3(normal(generator), normal(generator), normal(generator));
  return sites;
}

void report(const char* name, const TriangleMesh& mesh, const std::vector<Vec3>& sites, bool last = false) {
  double build = 1e300, refit = 1e300, cut = 1e300;
  std::vector<VoronoiPiece> pieces;
  for (int repeat = 0; repeat < 3; ++repeat) {
    const double start = processor_seconds();
    RestrictedVoronoi voronoi(sites);
    const double built = processor_seconds();
    voronoi.update_sites(sites);
    const double refitted = processor_seconds();
    voronoi.compute(mesh.positions, mesh.triangles, pieces);
    build = std::min(build, built - start);
    refit = std::min(refit, refitted - built);
    cut = std::min(cut, processor_seconds() - refitted);
  }
  double area = 0;
  for (const VoronoiPiece& piece : pieces) area += piece.share();
  const double lost = std::abs(area / static_cast<double>(mesh.triangles.size()) - 1);
  std::printf(
      "  {\"case\": \"%s\", \"triangles\": %zu, \"sites\": %zu, \"pairs\": %zu, \"build_s\": %.5f, \"refit_s\": %.5f, "
      "\"cut_s\": %.5f, \"ns_per_pair\": %.1f, \"us_per_site\": %.3f, \"lost_share\": %.1e}%s\n",
      name, mesh.triangles.size(), sites.size(), pieces.size(), build, refit, cut,
      1e9 * cut / static_cast<double>(pieces.size()), 1e6 * (cut + refit) / static_cast<double>(sites.size()), lost,
      last ? "" : ",");
}

std::vector<Vec3> barycenters(const TriangleMesh& mesh) {
  std::vector<Vec3> result;
  for (const auto& t : mesh.triangles)
    result.push_back((mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3);
  return result;
}

void write_case(const char* prefix, std::size_t row, const TriangleMesh& mesh, const std::vector<Vec3>& sites) {
  const std::string stem = std::string(prefix) + std::to_string(row);
  std::ofstream facets(stem + ".off"), points(stem + ".xyz");
  facets << std::setprecision(17) << "OFF\n" << mesh.positions.size() << ' ' << mesh.triangles.size() << " 0\n";
  for (const Vec3& p : mesh.positions) facets << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
  for (const auto& t : mesh.triangles) facets << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
  points << std::setprecision(17);
  for (const Vec3& p : sites) points << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
}

}  // namespace

/// bench_voronoi [PREFIX]: with a prefix, facets and sites of the near cases go to PREFIX<row>.off and .xyz as well,
/// for other programs to be measured beside.
int main(int argc, char** argv) {
  omp_set_num_threads(1);
  std::printf("{\"bench\": \"voronoi\", \"threads\": 1, \"rows\": [\n");
  std::size_t row = 0;
  for (int n : {33, 91, 304}) {
    const TriangleMesh target = bumpy_sphere(n, 0.1);
    for (std::size_t num_sites : {1000, 10000, 100000}) {
      const std::vector<Vec3> sites = sites_near(target, num_sites);
      if (argc > 1) write_case(argv[1], row++, target, sites);
      report("near", target, sites);
    }
  }
  const TriangleMesh target = bumpy_sphere(33, 0.1);
  for (int n : {16, 32}) {
    TriangleMesh far = bumpy_sphere(n, 0);
    for (Vec3& p : far.positions) p = 1.8 * p + Vec3(0.1, 0.05, -0.07);
    report("far, target by samples", target, far.positions);
    report("far, samples by target", far, barycenters(target), n == 32);
  }
  std::printf("]}\n");
}
