// SPDX-License-Identifier: GPL-3.0-or-later
// Nanoseconds per quadrature point of the volume energy: value, value and gradient, value, gradient and Hessian; beside
// the same energy evaluated one Jacobian at a time with a general eigenvalue solver. JSON to stdout.
#include "subvol/fit/energies/volume_energy.h"

#include <omp.h>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <random>

using namespace subvol;
using namespace subvol::internal;

namespace {

/// n^3 cubes, each kept as a hex or split into prisms or tets, vertices moved at random.
VolumeMesh shaken(CellKind kind, int n) {
  VolumeMesh mesh;
  std::mt19937_64 engine(1);
  std::uniform_real_distribution<double> shift(-0.1, 0.1);
  for (int k = 0; k <= n; ++k)
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i) mesh.positions.emplace_back(i + shift(engine), j + shift(engine), k + shift(engine));
  const auto add = [&mesh](CellKind cell, std::initializer_list<Index> v) {
    mesh.add_cell(cell, {v.begin(), v.size()});
  };
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const auto id = [&](int a, int b, int c) {
          return static_cast<Index>(i + a + (n + 1) * (j + b + (n + 1) * (k + c)));
        };
        const Index p[8] = {id(0, 0, 0), id(1, 0, 0), id(1, 1, 0), id(0, 1, 0),
                            id(0, 0, 1), id(1, 0, 1), id(1, 1, 1), id(0, 1, 1)};
        if (kind == CellKind::hex) mesh.add_cell(kind, p);
        if (kind == CellKind::prism) {
          add(kind, {p[0], p[1], p[2], p[4], p[5], p[6]});
          add(kind, {p[0], p[2], p[3], p[4], p[6], p[7]});
        }
        if (kind == CellKind::tet)
          for (const auto& [a, b] : {std::pair{1, 2}, {2, 3}, {3, 7}, {7, 4}, {4, 5}, {5, 1}})
            add(kind, {p[0], p[a], p[b], p[6]});
      }
  return mesh;
}

template <class Run>
double best_ns(double points, const Run& run) {
  double best = 1e300;
  for (int repeat = 0; repeat < 9; ++repeat) {
    const auto start = std::chrono::steady_clock::now();
    run();
    best = std::min(best, std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count());
  }
  return best / points;
}

/// Energy and gradient of one Jacobian by Eigen's eigenvalue solver: what the batched kernel is measured against.
double reference_hencky(const Mat3& j, Mat3& stress) {
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(j.transpose() * j);
  const Vec3 log_s = 0.5 * eigen.eigenvalues().array().log();
  stress = j * eigen.eigenvectors() * (log_s.array() / eigen.eigenvalues().array()).matrix().asDiagonal() *
           eigen.eigenvectors().transpose();
  return 0.5 * log_s.squaredNorm();
}

}  // namespace

int main() {
  omp_set_num_threads(1);
  std::printf("{\"bench\": \"volume energy\", \"unit\": \"ns per quadrature point, one thread\", \"rows\": [");
  const char* separator = "";
  for (CellKind kind : {CellKind::hex, CellKind::prism, CellKind::tet})
    for (int n : {2, 3}) {
      if (kind == CellKind::tet && n > 2) continue;
      const VolumeMesh mesh = shaken(kind, 24);
      const std::vector<Vec3> lengths(mesh.num_cells(), Vec3::Ones());
      const VolumeEnergy energy(mesh, lengths, n);
      const ElementRule rule = make_element_rule(kind, n);
      const double points = static_cast<double>(mesh.num_cells() * rule.num_points());
      std::vector<Vec3> gradient(mesh.num_vertices(), Vec3::Zero());
      BlockSparse hessian = energy.pattern();
      double sum = 0;
      const double value = best_ns(points, [&] { sum += energy.value(mesh.positions); });
      const double first = best_ns(points, [&] { sum += energy.add_gradient(mesh.positions, 1, gradient); });
      const double second = best_ns(points, [&] { sum += energy.add_hessian(mesh.positions, 1, gradient, hessian); });
      const double reference = best_ns(points, [&] {
        for (std::size_t c = 0; c < mesh.num_cells(); ++c)
          for (std::size_t q = 0; q < rule.num_points(); ++q) {
            Mat3 j = Mat3::Zero(), stress;
            for (const auto& entry : rule.point(q))
              j += mesh.positions[mesh.cell(c)[entry.vertex]] *
                   Eigen::Map<const Eigen::RowVector3d>(entry.gradient.data());
            sum += reference_hencky(j, stress);
            for (const auto& entry : rule.point(q))
              gradient[mesh.cell(c)[entry.vertex]] += stress * Eigen::Map<const Vec3>(entry.gradient.data());
          }
      });
      std::printf(
          "%s\n {\"kind\": \"%s\", \"points_per_direction\": %d, \"value\": %.1f, \"gradient\": %.1f, \"hessian\": "
          "%.1f, \"one_by_one_gradient\": %.1f, \"ratio\": %.2f}",
          separator, cell_topology(kind).name, n, value, first, second, reference, reference / first);
      separator = ",";
      if (!std::isfinite(sum)) return 1;
    }
  std::printf("\n]}\n");
}
