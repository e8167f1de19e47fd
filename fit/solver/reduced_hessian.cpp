// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/solver/reduced_hessian.h"

#include "subvol/fit/solver/vector_math.h"

#include <Eigen/LU>

#include <cmath>

namespace subvol::internal {

double Linearization::linearize(FitProblem& problem, std::span<const Vec3> y, std::span<const Vec3> z,
                                bool keeps_hessian, bool is_assigned) {
  SurfaceTerm* surface = problem.surface.get();
  if (surface && !is_assigned) surface->assign(z);
  node_gradient_.assign(y.size(), Vec3::Zero());
  gradient_.resize(problem.nodes.num_cols);
  const double distance = surface ? surface->value(z) : 0;
  const double distortion = keeps_hessian ? problem.volume->add_gradient(y, problem.lambda, node_gradient_)
                                          : problem.volume->linearize(y, problem.lambda, node_gradient_);
  const double energy = distance + problem.lambda * distortion;
  if (!std::isfinite(energy)) return energy;
  problem.nodes_transposed.apply(node_gradient_, gradient_);
  if (surface) {
    sample_gradient_.assign(z.size(), Vec3::Zero());
    from_samples_.resize(gradient_.size());
    surface->add_gradient(z, sample_gradient_);
    problem.pull_back_samples(sample_gradient_, from_samples_);
    add_scaled(1, from_samples_, gradient_);
  }
  return energy;
}

ReducedHessian::ReducedHessian(const FitProblem& problem)
    : problem_(problem),
      node_in_(problem.nodes.num_rows()),
      node_out_(problem.nodes.num_rows()),
      sample_in_(problem.samples.num_rows()),
      sample_out_(problem.samples.num_rows()),
      from_samples_(problem.nodes.num_cols) {}

std::vector<Mat3> ReducedHessian::diagonal() const {
  std::vector<Mat3> blocks(problem_.nodes.num_cols, Mat3::Zero());
  problem_.volume->add_diagonal_blocks(problem_.nodes, problem_.nodes_transposed, blocks);
  if (problem_.surface)
    add_diagonal_blocks(problem_.samples, problem_.samples_transposed, problem_.surface->hessian(), blocks);
  return blocks;
}

void ReducedHessian::multiply(std::span<const Vec3> in, std::span<Vec3> out) {
  problem_.nodes.apply(in, node_in_);
  problem_.volume->multiply(node_in_, node_out_);
  problem_.nodes_transposed.apply(node_out_, out);
  if (problem_.surface) {
    problem_.multiply_samples(in, sample_in_);
    problem_.surface->hessian().multiply(sample_in_, sample_out_);
    problem_.pull_back_samples(sample_out_, from_samples_);
    add_scaled(1, from_samples_, out);
  }
  if (added_.empty()) return;
#pragma omp parallel for schedule(static)
  for (std::size_t j = 0; j < in.size(); ++j) out[j] += added_[j] * in[j];
}

namespace {

bool is_positive_definite(const Mat3& block) {
  return block(0, 0) > 0 && block.topLeftCorner<2, 2>().determinant() > 0 && block.determinant() > 0;
}

/// Returns the inverse of a block, or that of its trace times the identity if the block is not positive definite.
Mat3 positive_inverse(const Mat3& block, double trace) {
  if (is_positive_definite(block)) {
    Mat3 inverse = block.inverse();
    if (inverse.allFinite()) return inverse;
  }
  return Mat3::Identity() / trace;
}

}  // namespace

std::vector<Mat3> inverse_blocks(std::span<const Mat3> blocks, std::span<const Mat3> projectors) {
  std::vector<Mat3> inverse(blocks.size());
#pragma omp parallel for schedule(static)
  for (std::size_t j = 0; j < blocks.size(); ++j) {
    const double trace = blocks[j].trace();
    if (!(trace > 0)) {
      inverse[j].setZero();
    } else if (projectors.empty()) {
      inverse[j] = positive_inverse(blocks[j], trace);
    } else {
      const Mat3& p = projectors[j];
      // Any positive value across the image serves: it is projected away again.
      const Mat3 block = p * blocks[j] * p + trace * (Mat3::Identity() - p);
      inverse[j] = p * positive_inverse(block, trace) * p;
    }
  }
  return inverse;
}

int conjugate_gradients(ReducedHessian& hessian, std::span<const Mat3> inverse_diagonal, std::span<const Vec3> gradient,
                        const MinimizerOptions& options, std::vector<Vec3>& d) {
  const std::size_t n = gradient.size();
  std::vector<Vec3> r(n), z(n), p(n), hp(n);
  const auto precondition = [&] {
#pragma omp parallel for schedule(static)
    for (std::size_t j = 0; j < n; ++j) z[j] = inverse_diagonal[j] * r[j];
  };
  d.assign(n, Vec3::Zero());
  for (std::size_t i = 0; i < n; ++i) r[i] = -gradient[i];
  precondition();
  p = z;
  double rz = dot(r, z);
  const double stop = options.cg_tolerance * options.cg_tolerance * rz;
  int iteration = 0;
  while (iteration < options.cg_max_iterations && rz > stop && !(options.ended && options.ended())) {
    ++iteration;
    hessian.multiply(p, hp);
    const double php = dot(p, hp);
    if (!(php > 0)) break;
    add_scaled(rz / php, p, d);
    add_scaled(-rz / php, hp, r);
    precondition();
    const double next = dot(r, z);
    const double beta = next / rz;
    rz = next;
#pragma omp parallel for schedule(static)
    for (std::size_t i = 0; i < n; ++i) p[i] = z[i] + beta * p[i];
  }
  return iteration;
}

}  // namespace subvol::internal
