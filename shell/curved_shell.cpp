// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/shell/curved_shell.h"

#include "subvol/base/error.h"
#include "subvol/base/sort_unique.h"
#include "subvol/fit/certificate/high_order_certificate.h"
#include "subvol/fit/energies/high_order_energy.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/stages/stage_runner.h"
#include "subvol/shell/shell_check.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>

namespace subvol {

using namespace internal;
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kLeastIntervals = 4;  // of samples along an edge
/// Share of the work that is done when the straight shell is there.
constexpr double kStraightShare = 0.97;

/// Calls visit(first node, number of nodes, vertices) for every vertex, edge, face and cell of a space.
template <class Visit>
void for_each_entity(const ElementSpace& space, const Visit& visit) {
  const MeshTopology& topology = space.topology();
  for (std::size_t v = 0; v < space.num_vertices(); ++v) {
    const Index vertex = static_cast<Index>(v);
    visit(v, std::size_t{1}, std::span(&vertex, 1));
  }
  for (std::size_t e = 0; e < topology.num_edges(); ++e)
    visit(space.edge_nodes(e), space.edge_nodes(e + 1) - space.edge_nodes(e),
          std::span<const Index>(topology.edge(static_cast<Index>(e))));
  for (std::size_t f = 0; f < topology.num_faces(); ++f)
    visit(space.face_nodes(f), space.face_nodes(f + 1) - space.face_nodes(f), topology.face(static_cast<Index>(f)));
  for (std::size_t c = 0; c < space.num_cells(); ++c)
    visit(space.cell_nodes(c), space.cell_nodes(c + 1) - space.cell_nodes(c), space.vertices(c));
}

/// A mode belongs to the strands of all vertices of its edge, face or cell; if there are none, it belongs to the
/// surface.
NodeStrands node_strands(const ShellLayers& layers, const ElementSpace& space) {
  NodeStrands nodes;
  std::vector<Index> strands;
  for_each_entity(space, [&](std::size_t, std::size_t count, std::span<const Index> vertices) {
    strands.clear();
    for (const Index v : vertices)
      if (const Index strand = layers.strand(v); strand != kNoIndex) strands.push_back(strand);
    sort_unique(strands);
    for (std::size_t i = 0; i < count; ++i) {
      nodes.strands.insert(nodes.strands.end(), strands.begin(), strands.end());
      nodes.offsets.push_back(nodes.strands.size());
    }
  });
  return nodes;
}

CurvedBoundary uniform_boundary(const HighOrderMesh& mesh) {
  const std::span<const Index> faces = mesh.space.topology().boundary_faces();
  BoundarySamples samples = make_boundary_samples(mesh.space, std::max(kLeastIntervals, 2 * mesh.space.max_order()));
  CurvedBoundary boundary{{samples.positions.apply(mesh.coefficients), std::move(samples.triangles)}, {}};
  for (const Index f : samples.triangle_faces)
    boundary.faces.push_back(static_cast<Index>(std::lower_bound(faces.begin(), faces.end(), f) - faces.begin()));
  return boundary;
}

/// Checks that curved cells are certified and that the triangles of their boundary do not intersect.
class CurvedShellCheck {
 public:
  CurvedShellCheck(const ShellLayers& layers, const ElementSpace& space, const CurvedShellOptions& options)
      : layers_(layers), space_(space), make_boundary_(options.boundary ? options.boundary : uniform_boundary) {}

  /// ended  may end the search early. Empty: never.
  std::vector<std::array<Index, 2>> intersecting_faces(std::span<const Vec3> nodes,
                                                       const std::function<bool()>& ended = {}) const {
    const CurvedBoundary boundary = make_boundary_({space_, {nodes.begin(), nodes.end()}});
    const SelfIntersections found = self_intersections(boundary.triangles, ended);
    std::vector<std::array<Index, 2>> pairs;
    const auto add = [&](Index t, Index s) {
      const auto [f, g] = std::minmax(boundary.faces[t], boundary.faces[s]);
      pairs.push_back({f, g});
    };
    for (const auto& [t, s] : found.pairs) add(t, s);
    for (const Index t : found.degenerate) add(t, t);
    sort_unique(pairs);
    return pairs;
  }

  std::vector<Index> failing_strands(std::span<const Vec3> nodes, const std::function<bool()>& ended) const {
    std::vector<Index> strands;
    const auto add = [&](std::span<const Index> vertices) {
      for (const Index v : vertices)
        if (const Index strand = layers_.strand(v); strand != kNoIndex) strands.push_back(strand);
    };
    for (const Index c : certify(space_, nodes).not_certified) add(space_.vertices(c));
    const MeshTopology& topology = space_.topology();
    for (const auto& pair : intersecting_faces(nodes, ended))
      for (const Index place : pair) add(topology.face(topology.boundary_faces()[place]));
    sort_unique(strands);
    return strands;
  }

 private:
  const ShellLayers& layers_;
  const ElementSpace& space_;
  std::function<CurvedBoundary(const HighOrderMesh&)> make_boundary_;
};

/// Makes the problem with the surface's sheet fixed: nodes without a strand are not degrees of freedom. Those of
/// columns that stay in a plane move in it.
FitProblem make_problem(const ShellResult& shell, const HighOrderMesh& mesh, const NodeStrands& strands,
                        std::vector<Vec3>& unknowns) {
  SparseMap nodes;
  std::vector<Vec3> fixed(mesh.coefficients.size(), Vec3::Zero());
  for (std::size_t i = 0; i < fixed.size(); ++i) {
    if (strands.of_node(i).empty()) {
      fixed[i] = mesh.coefficients[i];
    } else {
      nodes.columns.push_back(static_cast<Index>(unknowns.size()));
      nodes.values.push_back(1);
      unknowns.push_back(mesh.coefficients[i]);
    }
    nodes.offsets.push_back(nodes.columns.size());
  }
  nodes.num_cols = unknowns.size();
  std::vector<Mat3> projectors;
  if (!shell.layers.planes.empty()) {
    std::vector<Index> columns;
    for (std::size_t i = 0; i < fixed.size(); ++i) {
      if (strands.of_node(i).empty()) continue;
      columns.clear();
      for (const Index strand : strands.of_node(i))
        columns.push_back(static_cast<Index>(static_cast<std::size_t>(strand) % shell.layers.num_columns()));
      projectors.push_back(shell.layers.planes.projector(columns));
    }
  }
  const std::vector<int> points(mesh.space.num_cells(),
                                std::max(kLeastDistortionPoints, points_for_order(mesh.space.max_order())));
  auto energy = std::make_unique<HighOrderEnergy>(mesh.space, shell_reference(shell.layers, shell.limited), points);
  energy->set_most_own_emphasis(0);  // cells in creases end near inversion and must not outweigh all others
  SparseMap samples = select_rows(nodes, {});
  FitProblem problem(std::move(nodes), std::move(samples), std::move(energy), nullptr, 1);
  problem.fixed_nodes = std::move(fixed);
  problem.projectors = std::move(projectors);
  return problem;
}

/// Minimizes from the straight shell. A solve that ends early leaves the best state so far.
void solve(const ShellResult& shell, const CurvedShellOptions& options, const NodeStrands& strands, HighOrderMesh& mesh,
           FitReport& report) {
  std::vector<Vec3> unknowns;
  FitProblem problem = make_problem(shell, mesh, strands, unknowns);
  const StageRunner runner(options.control);
  StageRecord record;
  record.name = "order " + std::to_string(options.order);
  record.order = options.order;
  record.cells = mesh.space.num_cells();
  runner.work() = WorkShare(kStraightShare);
  runner.work().begin_part(1, kDefaultShellIterations);
  if (runner.run(problem, {.lambda = 1, .max_iterations = kDefaultShellIterations}, std::move(record), unknowns,
                 report)) {
    report.stop_reason = stop_reason(report.stages.back().ended);
    report.explanation = report.stages.back().stop;
  }
  problem.apply_nodes(unknowns, mesh.coefficients);
}

CurvedShellOptions checked(const ShellResult& shell, const CurvedShellOptions& options) {
  if (options.order < 1 || options.order > kMaxOrder)
    throw InputError("shell: the order must be in 1 .. " + std::to_string(kMaxOrder) + ", got " +
                     std::to_string(options.order));
  if (options.control.max_iterations < 0 || !(options.control.time_limit_seconds >= 0))
    throw InputError("shell: limits of a solve must not be negative");
  if (!shell.failures.none()) throw InputError("shell: only a valid shell can be curved");
  return options;
}

}  // namespace

std::vector<Index> sheet_faces(const ShellLayers& layers, const MeshTopology& topology, int sheet) {
  const auto num_columns = static_cast<Index>(layers.num_columns());
  const std::size_t num_faces = layers.surface.num_faces();
  const std::size_t layer = static_cast<std::size_t>(sheet > 0 ? sheet - 1 : 0);
  std::vector<Index> faces;
  for (std::size_t c = layer * num_faces; c < (layer + 1) * num_faces; ++c)
    for (const Index f : topology.cell_faces(c)) {
      const auto face = topology.face(f);
      if (std::all_of(face.begin(), face.end(), [&](Index v) { return v / num_columns == sheet; })) faces.push_back(f);
    }
  return faces;
}

BoundarySamples sheet_samples(const ShellLayers& layers, const ElementSpace& space, int sheet, int intervals) {
  const MeshTopology& topology = space.topology();
  const SurfaceTopology& surface = layers.topology;
  std::vector<Index> edges;
  for (const Index h : surface.edge_corners)
    edges.push_back(topology.find_edge(layers.vertex(sheet, surface.corner_vertices[h]),
                                       layers.vertex(sheet, surface.corner_vertices[surface.next(h)])));
  BoundarySamples samples = make_face_samples(space, sheet_faces(layers, topology, sheet), intervals, edges);
  if (sheet == 0)  // its faces are oriented as seen from below
    for (auto& [a, b, c] : samples.triangles) std::swap(b, c);
  return samples;
}

CurvedShell curve_shell(const ShellResult& shell, const CurvedShellOptions& unchecked) {
  const CurvedShellOptions options = checked(shell, unchecked);
  CurvedShell curved{.mesh = HighOrderMesh(ElementSpace(shell.mesh, options.basis, options.order), shell.mesh),
                     .quality = {},
                     .intersecting_faces = {},
                     .thickness = {},
                     .report = {}};
  const ElementSpace& space = curved.mesh.space;
  const NodeStrands strands = node_strands(shell.layers, space);
  const std::vector<Vec3> straight = curved.mesh.coefficients;
  const auto begin = Clock::now();
  const auto is_late = [&] {
    return options.control.time_limit_seconds > 0 &&
           std::chrono::duration<double>(Clock::now() - begin).count() > options.control.time_limit_seconds;
  };
  const auto ended = [&] { return (options.control.cancelled && options.control.cancelled()) || is_late(); };
  solve(shell, options, strands, curved.mesh, curved.report);

  const CurvedShellCheck check(shell.layers, space, options);
  std::vector<double> shares;
  curved.mesh.coefficients = advance(
      shell.layers, strands, [&](std::span<const Vec3> nodes) { return check.failing_strands(nodes, ended); }, straight,
      curved.mesh.coefficients, ended, &shares);
  const auto held = std::count_if(shares.begin(), shares.end(), [](double share) { return share < 1; });
  if (held > 0 && ended()) {
    curved.report.stop_reason = is_late() ? StopReason::time_limit : StopReason::cancelled;
    curved.report.explanation = "ended before the curved cells were checked; they are straight";
  } else if (held > 0) {
    curved.report.warnings.push_back(std::to_string(held) +
                                     " columns are curved less than the solve had them: there "
                                     "faces met or cells were not certified");
  }
  curved.quality = measure_quality(curved.mesh, 0, shell_reference(shell.layers, shell.limited));
  curved.intersecting_faces = check.intersecting_faces(curved.mesh.coefficients);
  curved.thickness = measure_thickness(shell.layers, std::span(curved.mesh.coefficients).first(space.num_vertices()));
  return curved;
}

}  // namespace subvol
