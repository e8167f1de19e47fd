// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/high_order_certificate.h"
#include "subvol/base/error.h"
#include "subvol/base/parallel_errors.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/threads.h"

#include <Eigen/LU>
#include <catch2/catch.hpp>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

/// The obvious twin: det J of one cell from the shape functions.
class Twin {
 public:
  Twin(const HighOrderMesh& mesh, std::size_t c)
      : mesh_(mesh),
        c_(c),
        shapes_(mesh.space.kind(c), mesh.space.basis(), mesh.space.pattern_order(mesh.space.pattern(c))) {}

  double determinant(const Vec3& point) {
    shapes_.set_point(point);
    const auto modes = mesh_.space.modes(c_);
    Mat3 jacobian = Mat3::Zero();
    Vec3 gradient;
    for (std::size_t a = 0; a < modes.size(); ++a) {
      shapes_.value(modes[a], gradient);
      jacobian += mesh_.space.signs(c_)[a] * mesh_.coefficients[mesh_.space.nodes(c_)[a]] * gradient.transpose();
    }
    return jacobian.determinant();
  }

  /// Least of n + 1 points a direction, then along shrinking steps from there.
  double minimum(int n) {
    const CellKind kind = mesh_.space.kind(c_);
    const auto inside = [&](const Vec3& p) {
      if (p.minCoeff() < 0 || p.maxCoeff() > 1) return false;
      return kind == CellKind::hex || (kind == CellKind::prism ? p[0] + p[1] : p.sum()) <= 1 + 1e-12;
    };
    Vec3 best = Vec3::Zero();
    double least = determinant(best);
    const auto look = [&](const Vec3& p) {
      if (!inside(p)) return false;
      const double value = determinant(p);
      if (value < least) {
        least = value, best = p;
        return true;
      }
      return false;
    };
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n; ++j)
        for (int k = 0; k <= n; ++k) look(Vec3(i, j, k) / n);
    for (double step = 0.5 / n; step > 1e-5; step /= 2)
      for (bool moved = true; moved;) {
        moved = false;
        for (int d = 0; d < 3; ++d)
          for (const double sign : {-1.0, 1.0}) moved = look(best + sign * step * Vec3::Unit(d)) || moved;
      }
    return least;
  }

 private:
  const HighOrderMesh& mesh_;
  std::size_t c_;
  ShapeFunctions shapes_;
};

/// A mesh whose modes are random, falling with the square of their order.
HighOrderMesh curved(const VolumeMesh& straight, Basis basis, int order, double amplitude, PointSource& source) {
  HighOrderMesh mesh(ElementSpace(straight, basis, order), straight);
  const ElementSpace& space = mesh.space;
  std::normal_distribution<double> normal;
  for (std::size_t c = 0; c < space.num_cells(); ++c)
    for (std::size_t a = 0; a < space.nodes(c).size(); ++a) {
      const std::size_t node = space.nodes(c)[a];
      if (node < space.num_vertices()) continue;
      const LocalMode& m = space.modes(c)[a];
      for (int d = 0; d < 3; ++d)
        mesh.coefficients[node][d] = amplitude * normal(source.random()) / (1.0 + m.i * m.i + m.j * m.j + m.k * m.k);
    }
  return mesh;
}

HighOrderMesh scaled_modes(const HighOrderMesh& mesh, double factor) {
  HighOrderMesh result = mesh;
  for (std::size_t i = mesh.space.num_vertices(); i < mesh.coefficients.size(); ++i) result.coefficients[i] *= factor;
  return result;
}

}  // namespace

TEST_CASE("affine cells of any order are certified in one box, with their exact determinant",
          "[high_order_certificate]") {
  const Mat3 matrix = (Mat3() << 1, 0.6, -0.2, 0.1, 0.8, 0.4, -0.5, 0.2, 7).finished();
  for (const CellKind kind : kAllKinds)
    for (const Basis basis : kBothBases)
      for (const int order : {1, 2, 3, 4, 8, 12, kMaxOrder}) {
        VolumeMesh mesh = single_cell(kind);
        for (Vec3& p : mesh.positions) p = matrix * p + Vec3(100, -20, 3);
        const HighOrderMesh straight(ElementSpace(mesh, basis, order), mesh);
        const CellCertificate result = HighOrderCertifier(straight.space).certify(straight.coefficients, 0);
        CAPTURE(kind, basis, order);
        CHECK(result.validity == CellValidity::valid);
        CHECK(result.boxes == 1);
        CHECK(result.lower_bound == Approx(matrix.determinant()).epsilon(1e-8));
        CHECK(result.lower_bound < matrix.determinant());
      }
}

TEST_CASE("no curved cell is certified against its samples, none refuted without a witness",
          "[high_order_certificate][slow]") {
  PointSource source(101);
  std::size_t valid = 0, invalid = 0, undecided = 0;
  for (const CellKind kind : kAllKinds)
    for (const Basis basis : kBothBases)
      for (const auto& [order, repeats] : {std::pair{2, 60}, std::pair{4, 40}, std::pair{8, 12}, std::pair{12, 4}})
        for (int repeat = 0; repeat < repeats; ++repeat) {
          if (kind == CellKind::tet && order > 8 && repeat % 3 == 0) continue;  // half a second each
          VolumeMesh straight = single_cell(kind);
          jitter(straight, 0.15, source.random()());
          const HighOrderMesh mesh =
              curved(renumbered(straight, source.random()), basis, order, 0.4 * (repeat % 8), source);
          const CellCertificate result = HighOrderCertifier(mesh.space).certify(mesh.coefficients, 0);
          Twin twin(mesh, 0);
          CAPTURE(kind, basis, order, repeat, result.boxes);
          if (result.validity == CellValidity::valid) {
            CHECK(result.lower_bound > 0);
            CHECK(result.lower_bound <= twin.minimum(order > 8 ? 6 : 10));
          }
          if (result.validity == CellValidity::invalid) CHECK(twin.determinant(result.witness) < 0);
          ++(result.validity == CellValidity::valid     ? valid
             : result.validity == CellValidity::invalid ? invalid
                                                        : undecided);
          CHECK(result.validity != CellValidity::undecided);
        }
  CAPTURE(valid, invalid, undecided);
  CHECK(undecided < (valid + invalid) / 100);
  CHECK(valid > (valid + invalid) / 4);
  CHECK(invalid > (valid + invalid) / 4);
}

TEST_CASE("cells that come close to inversion are decided on both sides", "[high_order_certificate][slow]") {
  PointSource source(103);
  for (const CellKind kind : kAllKinds)
    for (const Basis basis : kBothBases)
      for (const auto& [order, repeats] : {std::pair{2, 4}, std::pair{4, 3}, std::pair{8, 1}, std::pair{12, 1}})
        for (int repeat = 0; repeat < repeats; ++repeat) {
          if (kind != CellKind::hex && order > 8) continue;  // a minute
          const HighOrderMesh mesh = curved(single_cell(kind), basis, order, 0.3, source);
          const auto certify_scaled = [&](double t) {
            return HighOrderCertifier(mesh.space, {.max_depth = 12, .max_boxes = 20000})
                .certify(scaled_modes(mesh, t).coefficients, 0);
          };
          // Of the amplitude. Rounding in models of high orders on simplices is some 1e-11 of the size of the cell.
          constexpr double gap = 1e-5;
          double low = 0, high = 100;
          CAPTURE(kind, basis, order, repeat);
          while (high - low > gap * high) {
            const double middle = 0.5 * (low + high);
            const CellValidity validity = certify_scaled(middle).validity;
            if (validity == CellValidity::undecided) {  // by chance as close to the border as rounding is
              low = (1 - gap) * middle, high = (1 + gap) * middle;
              break;
            }
            (validity == CellValidity::valid ? low : high) = middle;
          }
          CAPTURE(low, high);
          CHECK(certify_scaled(low).validity == CellValidity::valid);
          CHECK(certify_scaled(high).validity == CellValidity::invalid);
          const HighOrderMesh below = scaled_modes(mesh, low), above = scaled_modes(mesh, high);
          const double least = Twin(below, 0).minimum(order > 8 ? 6 : 10);
          CHECK(certify_scaled(low).lower_bound <= least);
          CHECK(Twin(above, 0).determinant(certify_scaled(high).witness) < 0);
        }
}

TEST_CASE("order 1 agrees with the certificate of linear cells", "[high_order_certificate]") {
  PointSource source(107);
  for (const CellKind kind : kAllKinds)
    for (int repeat = 0; repeat < 2000; ++repeat) {
      VolumeMesh mesh = single_cell(kind);
      jitter(mesh, 0.5, source.random()());
      const ElementSpace space(mesh, kBothBases[repeat % 2], 1);
      const CellCertificate high = HighOrderCertifier(space).certify(mesh.positions, 0);
      const CellCertificate linear = certify_cell(kind, mesh.positions);
      CAPTURE(kind, repeat, high.boxes, linear.boxes, linear.lower_bound);
      CHECK(high.validity == linear.validity);
    }
}

TEST_CASE("all cells of a mesh are judged alike with any number of threads and numbering", "[high_order_certificate]") {
  PointSource source(109);
  test::ThreadGuard guard;
  for (const Basis basis : kBothBases) {
    const HighOrderMesh mesh = curved(renumbered(lattice(3, 3, 2), source.random()), basis, 4, 1.2, source);
    CertificateSummary summary;
    for (const int n : {1, 2, 8}) {
      guard.use(n);
      const CertificateSummary again = certify(mesh.space, mesh.coefficients);
      if (n > 1) CHECK(again.not_certified == summary.not_certified);
      if (n > 1) CHECK(again.invalid_cells == summary.invalid_cells);
      summary = again;
    }
    CHECK(summary.certified > 0);
    CHECK(summary.invalid > 0);
    for (std::size_t c = 0; c < mesh.space.num_cells(); ++c) {
      const bool refuted = std::ranges::count(summary.invalid_cells, static_cast<Index>(c)) > 0;
      if (!refuted) CHECK(Twin(mesh, c).minimum(8) > 0);
    }
  }
}

TEST_CASE("cells that touch zero or are not finite stay undecided, wrong options are refused",
          "[high_order_certificate]") {
  VolumeMesh mesh = lattice(1, 1, 1);
  const ElementSpace space(mesh, Basis::fourier, 3);
  HighOrderMesh flat(space, mesh);
  flat.coefficients[7] = flat.coefficients[6];  // det J = 0 at a corner
  const CertificateOptions few{.max_boxes = 200};
  CHECK(HighOrderCertifier(space, few).certify(flat.coefficients, 0).validity == CellValidity::undecided);
  for (Vec3& x : flat.coefficients) x[2] = 0;
  CHECK(HighOrderCertifier(space, few).certify(flat.coefficients, 0).validity == CellValidity::undecided);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e200}) {
    HighOrderMesh wrong(space, mesh);
    wrong.coefficients[20][1] = bad;
    CHECK(certify(space, wrong.coefficients).undecided == 1);
  }
  const HighOrderMesh good(space, mesh);
  CHECK(certify(space, good.coefficients).all_certified());
  CHECK_THROWS_AS(certify(space, std::span(good.coefficients).first(3)), InputError);
  CHECK_THROWS_AS(certify(space, good.coefficients, {.max_depth = -1}), InputError);
  CHECK_THROWS_AS(HighOrderCertifier(space, {.max_boxes = 0}), InputError);
}

TEST_CASE("What is thrown in a parallel region is thrown again after it", "[high_order_certificate]") {
  for (const int bad : {-1, 0, 57, 99}) {
    ParallelErrors errors;
    int done = 0;
#pragma omp parallel for num_threads(4) reduction(+ : done)
    for (int i = 0; i < 100; ++i)
      errors.guard([&] {
        if (i == bad) throw std::bad_alloc();
        ++done;
      });
    if (bad < 0) {
      CHECK_NOTHROW(errors.rethrow());
      CHECK(done == 100);
    } else {
      CHECK_THROWS_AS(errors.rethrow(), std::bad_alloc);
      CHECK(done < 100);
    }
  }
}

// Models of high Legendre modes have errors many times the modes themselves, which grow from direction to direction.
TEST_CASE("Hexes with one high mode along their edges are decided with few boxes", "[high_order_certificate]") {
  const VolumeMesh straight = single_cell(CellKind::hex);
  for (const Basis basis : kBothBases)
    for (const int order : {8, 9, 10, 12, 14, 16})
      for (const double amplitude : {0.005, 0.02}) {
        CAPTURE(to_string(basis), order, amplitude);
        HighOrderMesh mesh(ElementSpace(straight, basis, order), straight);
        for (std::size_t e = 0; e < mesh.space.topology().num_edges(); ++e)
          mesh.coefficients[mesh.space.edge_nodes(e) + static_cast<std::size_t>(order) - 2] = Vec3(0, 0, amplitude);
        const CellCertificate found = HighOrderCertifier(mesh.space).certify(mesh.coefficients, 0);
        CHECK(found.validity == CellValidity::valid);
        CHECK(found.boxes < 400);
        CHECK(found.lower_bound > 0);
      }
}
