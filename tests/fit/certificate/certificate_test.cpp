// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/certificate.h"
#include "subvol/base/error.h"
#include "tests/support/threads.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <limits>
#include <random>

using namespace subvol;

namespace {

using Corners = std::vector<Vec3>;

Corners reference_corners(CellKind kind) {
  if (kind == CellKind::tet) return {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  if (kind == CellKind::prism) return {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
  if (kind == CellKind::pyramid) return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}};
  return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
}

/// The obvious twin: derivatives of the linear shape functions, one corner at a time.
double determinant_at(CellKind kind, const Corners& x, const Vec3& p) {
  const Corners reference = reference_corners(kind);
  Mat3 jacobian = Mat3::Zero();
  for (std::size_t v = 0; v < x.size(); ++v) {
    Vec3 gradient;
    if (kind == CellKind::pyramid) {  // the hex whose upper corners are the apex, whose det J has a factor (1 - w)^2
      Corners hex(x.begin(), x.begin() + 4);
      hex.insert(hex.end(), 4, x[4]);
      const double below = 1 - p[2];
      return determinant_at(CellKind::hex, hex, {p[0] / below, p[1] / below, p[2]}) / (below * below);
    }
    if (kind == CellKind::hex) {
      Vec3 factor, slope;
      for (int d = 0; d < 3; ++d) {
        factor[d] = reference[v][d] == 1 ? p[d] : 1 - p[d];
        slope[d] = reference[v][d] == 1 ? 1 : -1;
      }
      gradient = {slope[0] * factor[1] * factor[2], factor[0] * slope[1] * factor[2], factor[0] * factor[1] * slope[2]};
    } else if (kind == CellKind::prism) {
      const double barycentric[3] = {1 - p[0] - p[1], p[0], p[1]};
      const double du[3] = {-1, 1, 0}, dv[3] = {-1, 0, 1};
      const bool top = v >= 3;
      const double height = top ? p[2] : 1 - p[2];
      gradient = {du[v % 3] * height, dv[v % 3] * height, barycentric[v % 3] * (top ? 1 : -1)};
    } else {
      const Vec3 gradients[4] = {{-1, -1, -1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
      gradient = gradients[v];
    }
    jacobian += x[v] * gradient.transpose();
  }
  return jacobian.determinant();
}

double dense_minimum(CellKind kind, const Corners& x, int n) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j)
      for (int k = 0; k <= n; ++k) {
        if ((kind == CellKind::tet || kind == CellKind::prism) && i + j > n) continue;
        if (kind == CellKind::pyramid && (k == n || std::max(i, j) + k > n)) continue;
        least = std::min(least, determinant_at(kind, x, Vec3(i, j, k) / n));
      }
  return least;
}

Corners shaken(CellKind kind, double amplitude, std::mt19937_64& engine) {
  std::uniform_real_distribution<double> shift(-amplitude, amplitude);
  Corners x = reference_corners(kind);
  for (Vec3& p : x) p += Vec3(shift(engine), shift(engine), shift(engine));
  return x;
}

bool has_positive_corners(CellKind kind, const Corners& x) {
  const Corners reference = reference_corners(kind);
  return std::all_of(reference.begin(), reference.end(), [&](const Vec3& p) { return determinant_at(kind, x, p) > 0; });
}

/// Cells of one kind, no vertex shared.
VolumeMesh soup(CellKind kind, const std::vector<Corners>& cells) {
  VolumeMesh mesh;
  for (const Corners& x : cells) {
    std::vector<Index> vertices(x.size());
    for (std::size_t v = 0; v < x.size(); ++v) vertices[v] = static_cast<Index>(mesh.positions.size() + v);
    mesh.positions.insert(mesh.positions.end(), x.begin(), x.end());
    mesh.add_cell(kind, vertices);
  }
  return mesh;
}

/// A hex with positive corners and an inverted middle: two opposite faces twisted against each other.
Corners twisted_hex(double angle) {
  Corners x = reference_corners(CellKind::hex);
  for (std::size_t v = 4; v < 8; ++v) {
    const double px = x[v][0] - 0.5, py = x[v][1] - 0.5;
    x[v][0] = 0.5 + std::cos(angle) * px - std::sin(angle) * py;
    x[v][1] = 0.5 + std::sin(angle) * px + std::cos(angle) * py;
  }
  return x;
}

}  // namespace

TEST_CASE("reference cells have the determinant 1 everywhere", "[certificate]") {
  for (const CellKind kind : {CellKind::tet, CellKind::prism, CellKind::hex, CellKind::pyramid}) {
    const CellCertificate result = certify_cell(kind, reference_corners(kind));
    CHECK(result.validity == CellValidity::valid);
    CHECK(result.boxes == 1);
    CHECK(result.lower_bound == Approx(1).epsilon(1e-13));
    CHECK(min_bernstein(kind, reference_corners(kind)) == 1.0);
  }
}

TEST_CASE("the certificate never passes an inverted hex with positive corners", "[certificate][slow]") {
  constexpr std::size_t kNumCells = 100000;
  std::mt19937_64 engine(20240817);
  std::vector<Corners> cells;
  while (cells.size() < kNumCells) {
    Corners x = shaken(CellKind::hex, 0.75, engine);
    if (has_positive_corners(CellKind::hex, x)) cells.push_back(std::move(x));
  }
  std::size_t certified = 0, invalid = 0, undecided = 0, hidden = 0, false_valid = 0, false_invalid = 0, bad_bound = 0;
#pragma omp parallel for reduction(+ : certified, invalid, undecided, hidden, false_valid, false_invalid, bad_bound)
  for (std::size_t c = 0; c < kNumCells; ++c) {
    const CellCertificate result = certify_cell(CellKind::hex, cells[c]);
    const double sampled = dense_minimum(CellKind::hex, cells[c], 6);
    certified += result.validity == CellValidity::valid;
    invalid += result.validity == CellValidity::invalid;
    undecided += result.validity == CellValidity::undecided;
    false_valid += result.validity == CellValidity::valid && sampled <= 0;
    false_invalid +=
        result.validity == CellValidity::invalid && !(determinant_at(CellKind::hex, cells[c], result.witness) < 1e-14);
    hidden += result.validity == CellValidity::invalid && sampled > 0;
    bad_bound += result.validity == CellValidity::valid && !(result.lower_bound > 0 && result.lower_bound <= sampled);
  }
  INFO("seed 20240817: " << certified << " valid, " << invalid << " invalid (" << hidden
                         << " of them unseen by 7^3 samples), " << undecided << " undecided");
  CHECK(false_valid == 0);
  CHECK(false_invalid == 0);
  CHECK(bad_bound == 0);
  CHECK(undecided == 0);
  CHECK(certified > kNumCells / 2);
  CHECK(invalid > 100);
}

TEST_CASE("the certificate never passes an inverted prism, tet or pyramid", "[certificate][slow]") {
  for (const CellKind kind : {CellKind::prism, CellKind::tet, CellKind::pyramid}) {
    std::mt19937_64 engine(7);
    std::size_t wrong = 0, invalid = 0, valid = 0;
    for (int c = 0; c < 40000; ++c) {
      const Corners x = shaken(kind, 0.6, engine);
      const CellCertificate result = certify_cell(kind, x);
      const double sampled = dense_minimum(kind, x, 6);
      wrong += result.validity == CellValidity::undecided;
      wrong += result.validity == CellValidity::valid && !(sampled >= result.lower_bound && result.lower_bound > 0);
      wrong += result.validity == CellValidity::invalid && !(determinant_at(kind, x, result.witness) < 1e-14);
      invalid += result.validity == CellValidity::invalid;
      valid += result.validity == CellValidity::valid;
    }
    CHECK(wrong == 0);
    CHECK(valid > 1000);
    CHECK(invalid > 1000);
  }
}

TEST_CASE("a twisted hex is refuted inside although its corners are positive", "[certificate]") {
  // det J of the twist by an angle t is 1 - 4 s(1-s) sin^2(t/2) at height s: least 1 at the ends, cos^2(t/2) amid.
  const Corners nearly = twisted_hex(3.0), past = [] {
    Corners x = twisted_hex(3.0);
    for (std::size_t v = 4; v < 8; ++v) x[v][0] += 0.4 * (v == 4 || v == 6 ? 1 : -1);
    return x;
  }();
  CHECK(certify_cell(CellKind::hex, nearly).validity == CellValidity::valid);
  CHECK(certify_cell(CellKind::hex, nearly).lower_bound <= std::pow(std::cos(1.5), 2));
  REQUIRE(has_positive_corners(CellKind::hex, past));
  const CellCertificate result = certify_cell(CellKind::hex, past);
  CHECK(result.validity == CellValidity::invalid);
  CHECK(result.witness_determinant < 0);
  CHECK(determinant_at(CellKind::hex, past, result.witness) == Approx(result.witness_determinant));
}

TEST_CASE("verdicts do not change under affine maps, scales and far origins", "[certificate]") {
  std::mt19937_64 engine(3);
  std::normal_distribution<double> normal;
  for (int c = 0; c < 2000; ++c) {
    const CellKind kind = c % 2 ? CellKind::hex : CellKind::prism;
    const Corners x = shaken(kind, 0.5, engine);
    Mat3 map;
    do {
      for (double& entry : map.reshaped()) entry = normal(engine);
      if (map.determinant() < 0) map.col(0) *= -1;
    } while (map.determinant() < 0.1);
    Corners y = x;
    for (Vec3& p : y) p = std::pow(10.0, c % 13 - 6) * (map * p) + Vec3(100, -20, 3);
    if (c % 13 < 6) continue;  // a shift much larger than the cell leaves nothing of it
    CHECK(certify_cell(kind, x).validity == certify_cell(kind, y).validity);
  }
}

TEST_CASE("a cell that degenerates to determinant zero ends undecided, a mirrored one invalid", "[certificate]") {
  Corners flat = reference_corners(CellKind::hex);
  flat[6] = flat[5];
  const CellCertificate degenerate = certify_cell(CellKind::hex, flat);
  CHECK(degenerate.validity == CellValidity::undecided);
  CHECK(degenerate.witness_determinant == 0);
  for (const CellKind kind : {CellKind::tet, CellKind::prism, CellKind::hex, CellKind::pyramid}) {
    Corners mirrored = reference_corners(kind);
    for (Vec3& p : mirrored) p[2] = -p[2];
    CHECK(certify_cell(kind, mirrored).validity == CellValidity::invalid);
    CHECK(certify_cell(kind, mirrored).witness_determinant == -1);
    Corners planar = reference_corners(kind);
    for (Vec3& p : planar) p[2] = 0;
    CHECK(certify_cell(kind, planar).validity == CellValidity::undecided);
  }
}

TEST_CASE("a coordinate that is not finite is never certified", "[certificate]") {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e200}) {
    for (int corner = 0; corner < 8; ++corner) {
      Corners x = reference_corners(CellKind::hex);
      x[corner][corner % 3] = bad;
      CHECK(certify_cell(CellKind::hex, x).validity == CellValidity::undecided);
      std::vector<Corners> cells(16, reference_corners(CellKind::hex));
      cells[9] = x;
      CHECK(certify(soup(CellKind::hex, cells)).not_certified == std::vector<Index>{9});
    }
  }
}

TEST_CASE("the batch agrees with the single cells for any number of threads", "[certificate]") {
  std::mt19937_64 engine(11);
  for (const CellKind kind : {CellKind::tet, CellKind::prism, CellKind::hex, CellKind::pyramid}) {
    std::vector<Corners> cells;
    for (int c = 0; c < 1003; ++c) cells.push_back(shaken(kind, 0.45, engine));
    const VolumeMesh mesh = soup(kind, cells);
    std::vector<Index> expected;
    for (std::size_t c = 0; c < cells.size(); ++c)
      if (certify_cell(kind, cells[c]).validity != CellValidity::valid) expected.push_back(static_cast<Index>(c));
    test::ThreadGuard guard;
    std::vector<std::vector<double>> minima;
    for (int threads : {1, 2}) {
      guard.use(threads);
      const CertificateSummary summary = certify(mesh);
      CHECK(summary.not_certified == expected);
      CHECK(summary.certified + summary.invalid + summary.undecided == cells.size());
      CHECK(summary.certified == cells.size() - expected.size());
      minima.emplace_back(cells.size());
      min_bernstein(mesh.positions, mesh, minima.back());
    }
    CHECK(minima[0] == minima[1]);
    std::vector<std::uint8_t> positive(cells.size());
    const std::size_t zeros = positive_bernstein(mesh.positions, mesh, positive);
    CHECK(zeros >= expected.size());
    CHECK(zeros == certify(mesh, {.max_depth = 0}).not_certified.size());
    for (const Index c : expected) CHECK(positive[c] == 0);
  }
}

TEST_CASE("the certificate refuses wrong sizes and options", "[certificate]") {
  const Corners x = reference_corners(CellKind::hex);
  const VolumeMesh mesh = soup(CellKind::hex, {x});
  std::vector<std::uint8_t> flags(2);
  CHECK_THROWS_AS(certify_cell(CellKind::prism, x), InputError);
  CHECK_THROWS_AS(certify_cell(CellKind::hex, x, {.max_depth = -1}), InputError);
  CHECK_THROWS_AS(certify_cell(CellKind::hex, x, {.max_boxes = 0}), InputError);
  CHECK_THROWS_AS(certify(std::span(x).first(7), mesh), InputError);
  CHECK_THROWS_AS(positive_bernstein(mesh.positions, mesh, flags), InputError);
}
