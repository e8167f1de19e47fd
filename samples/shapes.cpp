// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/shapes.h"

#include <subvol/mesh/features.h>
#include <subvol/mesh/mesh_topology.h>
#include <subvol/surface/boundary.h>
#include "subvol/subdivision/repeated_subdivision.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

namespace subvol::samples {

using namespace internal;
namespace {

constexpr double kTau = 2 * std::numbers::pi;
constexpr double kCreaseAngleDegrees = 40;

using Lattice = std::array<int, 3>;

// Hexes over unit cubes of a lattice, vertices shared, positions moved by a map.
template <typename Map>
VolumeMesh lattice_mesh(const std::vector<Lattice>& cubes, const Map& position) {
  static constexpr std::array<Lattice, 8> kUnitCubeCorners{
      {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}};
  VolumeMesh mesh;
  std::map<Lattice, Index> numbers;
  for (const Lattice& cube : cubes) {
    std::array<Index, 8> cell{};
    for (std::size_t c = 0; c < 8; ++c) {
      const Lattice node{cube[0] + kUnitCubeCorners[c][0], cube[1] + kUnitCubeCorners[c][1],
                         cube[2] + kUnitCubeCorners[c][2]};
      const auto [entry, added] = numbers.try_emplace(node, static_cast<Index>(mesh.positions.size()));
      if (added) mesh.positions.push_back(position(Vec3(node[0], node[1], node[2])));
      cell[c] = entry->second;
    }
    mesh.add_cell(CellKind::hex, cell);
  }
  return mesh;
}

TriangleMesh boundary_triangles(const VolumeMesh& mesh) {
  return triangulate(boundary_surface(mesh, MeshTopology(mesh)));
}

Vec3 on_torus(double around, double across, double tube_radius) {
  const double r = 1 + tube_radius * std::cos(across);
  return {r * std::cos(around), r * std::sin(around), tube_radius * std::sin(across)};
}

TriangleMesh bumpy_torus(int num_around, int num_across) {
  TriangleMesh mesh;
  for (int i = 0; i < num_around; ++i) {
    for (int j = 0; j < num_across; ++j) {
      const double u = kTau * i / num_around, v = kTau * j / num_across;
      mesh.positions.push_back(on_torus(u, v, 0.38 + 0.04 * std::cos(5 * u) * std::sin(2 * v)));
      const auto node = [&](int a, int b) {
        return static_cast<Index>((i + a) % num_around * num_across + (j + b) % num_across);
      };
      mesh.triangles.push_back({node(0, 0), node(1, 0), node(1, 1)});
      mesh.triangles.push_back({node(0, 0), node(1, 1), node(0, 1)});
    }
  }
  return mesh;
}

// Each section: nodes 0..3 of an inner square, 4..7 of an outer one. Hexes run from section to section.
VolumeMesh torus_ring(int num_sections) {
  VolumeMesh mesh;
  for (int s = 0; s < num_sections; ++s) {
    for (double radius : {0.17, 0.42}) {
      for (int k = 0; k < 4; ++k) {
        mesh.positions.push_back(on_torus(kTau * s / num_sections, kTau * (k + 0.5) / 4, radius));
      }
    }
  }
  for (int s = 0; s < num_sections; ++s) {
    const int next = (s + 1) % num_sections;
    const auto add = [&](std::array<int, 4> quad) {
      std::array<Index, 8> cell{};
      for (std::size_t k = 0; k < 4; ++k) {
        cell[k] = static_cast<Index>(8 * next + quad[k]);
        cell[k + 4] = static_cast<Index>(8 * s + quad[k]);
      }
      mesh.add_cell(CellKind::hex, cell);
    };
    add({0, 1, 2, 3});
    for (int k = 0; k < 4; ++k) add({k, 4 + k, 4 + (k + 1) % 4, (k + 1) % 4});
  }
  return mesh;
}

// Takes the cube [-1,1]^3 to a ball, spheres about its center from cubes about it.
Vec3 cube_to_ball(const Vec3& p) {
  const double length = p.norm();
  return length > 0 ? Vec3(p * (p.cwiseAbs().maxCoeff() / length)) : p;
}

std::vector<Lattice> box_of_cubes(int nx, int ny, int nz) {
  std::vector<Lattice> cubes;
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) cubes.push_back({i, j, k});
    }
  }
  return cubes;
}

/// The surface of the unit ball, moved by a map.
template <typename Map>
TriangleMesh mapped_sphere(int resolution, const Map& position) {
  const VolumeMesh cubes = lattice_mesh(box_of_cubes(resolution, resolution, resolution), [&](const Vec3& node) {
    return position(cube_to_ball(Vec3(node * (2.0 / resolution) - Vec3::Ones())));
  });
  return boundary_triangles(cubes);
}

TriangleMesh bumpy_ball(int resolution) {
  return mapped_sphere(resolution, [](const Vec3& p) {
    return Vec3(p * (1 + 0.08 * std::sin(4 * p.x()) * std::cos(3 * p.y()) + 0.05 * std::sin(5 * p.z())));
  });
}

VolumeMesh seven_cells() {
  static constexpr std::array<std::array<Index, 4>, 6> kInnerFaces{
      {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}};
  VolumeMesh mesh = lattice_mesh({{0, 0, 0}}, [](const Vec3& node) { return Vec3(0.45 * (2 * node - Vec3::Ones())); });
  const std::vector<Index> inner(mesh.cell(0).begin(), mesh.cell(0).end());
  for (std::size_t v = 0; v < 8; ++v) mesh.positions.push_back(mesh.positions[v].normalized());
  for (const auto& face : kInnerFaces) {
    std::array<Index, 8> cell{};
    for (std::size_t k = 0; k < 4; ++k) {
      cell[k] = inner[static_cast<std::size_t>(face[k])];
      cell[k + 4] = cell[k] + 8;
    }
    mesh.add_cell(CellKind::hex, cell);
  }
  return mesh;
}

// Cubes of an L that is three long, three high, two wide and one thick, cut `n` times finer.
std::vector<Lattice> bracket_cubes(int n) {
  std::vector<Lattice> cubes = box_of_cubes(3 * n, 2 * n, 3 * n);
  std::erase_if(cubes, [n](const Lattice& cube) { return cube[0] >= n && cube[2] >= n; });
  return cubes;
}

// The standard says which numbers the generator gives, but not those of its distributions.
double uniform(std::mt19937& generator) { return (static_cast<double>(generator()) + 0.5) / 4294967296.0; }

// The foot is bowed and the upright leans and widens a little.
Vec3 bend_bracket(const Vec3& p) {
  return {p.x() + 0.06 * p.z() * p.z() * (1 - p.x() / 3), (p.y() - 1) * (1 - 0.05 * p.z()),
          p.z() + 0.08 * std::sin(p.x() * kTau / 6)};
}

void append_number(std::string& text, double value, char end) {
  std::array<char, 32> buffer;
  text.append(buffer.data(), std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr);
  text += end;
}

}  // namespace

Sample torus_sample() { return {"torus", bumpy_torus(120, 48), torus_ring(12)}; }

Sample ball_sample() { return {"ball", bumpy_ball(24), seven_cells()}; }

Sample bracket_sample() {
  static constexpr int kBracketFineness = 8;
  VolumeMesh cells = lattice_mesh(bracket_cubes(1), [](const Vec3& p) { return Vec3(p - Vec3(0, 1, 0)); });
  cells.tags = features_by_angle(cells, kCreaseAngleDegrees);
  const VolumeMesh fine =
      lattice_mesh(bracket_cubes(kBracketFineness), [](const Vec3& p) { return bend_bracket(p / kBracketFineness); });
  return {"bracket", boundary_triangles(fine), cells};
}

TriangleMesh starfish_surface() {
  constexpr int kArms = 5, kResolution = 40;
  return mapped_sphere(kResolution, [](const Vec3& p) {
    const double equator = std::hypot(p.x(), p.y()), around = std::atan2(p.y(), p.x());
    const double arm = std::pow(0.5 + 0.5 * std::cos(kArms * around), 2) * std::pow(equator, 4);
    const double radius = 0.35 + 0.65 * arm, turned = around + 0.4 * radius * radius;
    const double across = radius * equator;
    return Vec3(across * std::cos(turned), across * std::sin(turned), 0.28 * (p.z() + 0.4 * (1 - arm) * p.z()));
  });
}

std::vector<Sample> all_samples() { return {torus_sample(), ball_sample(), bracket_sample()}; }

VolumeMesh tangled_ball() {
  constexpr double kThrow = 0.07;  // along every axis; half an edge or so
  VolumeMesh mesh = subdivide_repeatedly(ball_sample().template_mesh, 2);
  const MeshTopology topology(mesh);
  std::mt19937 generator(2);
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
    if (!topology.is_boundary_vertex(static_cast<Index>(v)))
      for (double& x : mesh.positions[v]) x += kThrow * (2 * uniform(generator) - 1);
  return mesh;
}

PointCloud scattered_points(const TriangleMesh& surface, std::size_t count, double noise) {
  std::mt19937 generator(1);
  const auto random = [&] { return uniform(generator); };
  std::vector<double> ends;  // of the triangles' areas in a row
  double area = 0;
  for (const auto& [a, b, c] : surface.triangles) {
    const Vec3& origin = surface.positions[a];
    area += (surface.positions[b] - origin).cross(surface.positions[c] - origin).norm();
    ends.push_back(area);
  }
  PointCloud cloud;
  while (cloud.points.size() < count && area > 0) {
    const auto t =
        static_cast<std::size_t>(std::lower_bound(ends.begin(), ends.end() - 1, area * random()) - ends.begin());
    const auto& [a, b, c] = surface.triangles[t];
    const double root = std::sqrt(random()), share = random();
    Vec3 point = (1 - root) * surface.positions[a] + root * (1 - share) * surface.positions[b] +
                 root * share * surface.positions[c];
    for (int axis = 0; axis < 3; ++axis) point[axis] += noise * (2 * random() - 1);
    cloud.points.push_back(point);
  }
  return cloud;
}

std::string xyz_text(const PointCloud& cloud) {
  std::string text;
  for (const Vec3& p : cloud.points) {
    append_number(text, p.x(), ' ');
    append_number(text, p.y(), ' ');
    append_number(text, p.z(), '\n');
  }
  return text;
}

std::string off_text(const TriangleMesh& mesh) {
  std::string text =
      "OFF\n" + std::to_string(mesh.positions.size()) + ' ' + std::to_string(mesh.triangles.size()) + " 0\n";
  for (const Vec3& p : mesh.positions) {
    append_number(text, p.x(), ' ');
    append_number(text, p.y(), ' ');
    append_number(text, p.z(), '\n');
  }
  for (const auto& t : mesh.triangles) {
    text += "3 " + std::to_string(t[0]) + ' ' + std::to_string(t[1]) + ' ' + std::to_string(t[2]) + '\n';
  }
  return text;
}

}  // namespace subvol::samples
