// SPDX-License-Identifier: GPL-3.0-or-later
// libFuzzer target of the fits: a tiny template and target whose vertices the bytes move, and options that they choose.
// Whatever they are, a fit returns finite positions, with every cell certified where it says it converged from a
// certified template, or throws InputError.

#include "samples/shapes.h"
#include "subvol/base/error.h"
#include "subvol/fit/certificate/certificate.h"
#include "subvol/fit/certificate/high_order_certificate.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/optimize_mesh.h"
#include "subvol/mesh/validate.h"
#include "tests/fuzz/bytes_as_file.h"

#include <cstring>

using namespace subvol;
using namespace subvol::internal;
using fuzz::require;

namespace {

/// Takes bytes from the front; zeros once there are none.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}
  int below(int n) { return take() % n; }
  bool flag() { return below(2) == 1; }
  /// Small moves mostly; now and then any double at all.
  double move(double length) {
    const int byte = take();
    if (byte != 255) return byte < 128 ? 0 : length * (byte - 192) / 64.0;
    double any = 0;
    std::uint8_t raw[sizeof any];
    for (std::uint8_t& b : raw) b = take();
    std::memcpy(&any, raw, sizeof any);
    return any;
  }

 private:
  std::uint8_t take() { return left_ == 0 ? 0 : (--left_, *data_++); }
  const std::uint8_t* data_;
  std::size_t left_;
};

/// An octahedron, once or twice as fine.
TriangleMesh small_target(bool fine) {
  TriangleMesh mesh{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
                    {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
  if (!fine) return mesh;
  TriangleMesh split = mesh;
  split.triangles.clear();
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto center = static_cast<Index>(split.positions.size());
    split.positions.push_back(0.5 * (mesh.positions[a] + mesh.positions[b] + mesh.positions[c]));
    for (const auto& [p, q] : {std::array{a, b}, {b, c}, {c, a}}) split.triangles.push_back({p, q, center});
  }
  return split;
}

VolumeMesh small_template(int kind) {
  VolumeMesh mesh;
  mesh.positions = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}};
  for (Vec3& p : mesh.positions) p *= 0.55;
  if (kind == 0) mesh.add_cell(CellKind::hex, std::array<Index, 8>{0, 1, 2, 3, 4, 5, 6, 7});
  if (kind == 1) {
    mesh.add_cell(CellKind::prism, std::array<Index, 6>{0, 1, 2, 4, 5, 6});
    mesh.add_cell(CellKind::prism, std::array<Index, 6>{0, 2, 3, 4, 6, 7});
  }
  if (kind == 2)
    for (const auto& [a, b] : {std::array<Index, 2>{1, 2}, {2, 3}, {3, 7}, {7, 4}, {4, 5}, {5, 1}})
      mesh.add_cell(CellKind::tet, std::array<Index, 4>{0, a, b, 6});
  return mesh;
}

void require_finite(const std::vector<Vec3>& points) {
  for (const Vec3& p : points) require(p.allFinite());
}

void fit(Bytes& bytes, const TriangleMesh& target, const VolumeMesh& start, bool sound) {
  FitOptions options{.levels = 1, .cage_only = bytes.flag(), .control = {.max_iterations = 2}};
  options.surface = bytes.flag() ? FittedSurface::mesh : FittedSurface::limit;
  options.correspondence = bytes.flag() ? Correspondence::voronoi : Correspondence::closest;
  options.solver = bytes.flag() ? SolverKind::lbfgs : SolverKind::newton;
  if (bytes.flag()) options.crease_angle_degrees = 30;
  const FitResult result = fit_subdivision_volume(target, start, options);
  require_finite(result.mesh.positions);
  require_finite(result.cage.positions);
  if (sound && result.report.stop_reason == StopReason::converged) require(certify(result.mesh).all_certified());
}

void fit_curved(Bytes& bytes, const TriangleMesh& target, const VolumeMesh& start, bool sound) {
  HighOrderFitOptions options{.order = 2, .adaptive = bytes.flag(), .control = {.max_iterations = 2}};
  options.basis = bytes.flag() ? Basis::legendre : Basis::fourier;
  options.improve_worst_places = bytes.flag();
  const HighOrderFitResult result = fit_high_order(target, start, options);
  require_finite(result.mesh.coefficients);
  if (sound) require(certify(result.mesh.space, result.mesh.coefficients).all_certified());
}

void optimize(Bytes& bytes, const TriangleMesh& target, const VolumeMesh& start) {
  OptimizeOptions options{.control = {.max_iterations = 2}};
  const bool has_target = bytes.flag();
  options.fixed_boundary = !has_target && bytes.flag();
  const OptimizeResult result = optimize_mesh(start, has_target ? &target : nullptr, options);
  require_finite(result.mesh.positions);
  require(certify(result.mesh).not_certified == result.uncertified);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes bytes(data, size);
  const int what = bytes.below(3);
  TriangleMesh target = small_target(bytes.flag());
  VolumeMesh start = small_template(bytes.below(3));
  Bytes choices(data + std::min<std::size_t>(size, 3), std::min<std::size_t>(size - std::min<std::size_t>(size, 3), 8));
  Bytes moves(data + std::min<std::size_t>(size, 11), size - std::min<std::size_t>(size, 11));
  for (std::vector<Vec3>* positions : {&start.positions, &target.positions})
    for (Vec3& p : *positions)
      for (double& coordinate : p) coordinate += moves.move(1);
  try {
    bool sound = true;
    for (const MeshDefect& defect : validate(start)) sound = sound && defect.kind == MeshDefect::Kind::unused_vertex;
    sound = sound && certify(start).all_certified();
    if (what == 0) fit(choices, target, start, sound);
    if (what == 1) fit_curved(choices, target, start, sound);
    if (what == 2) optimize(choices, target, start);
  } catch (const InputError&) {
  }
  return 0;
}
