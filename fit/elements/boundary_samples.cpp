// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/boundary_samples.h"

#include "subvol/base/error.h"
#include "subvol/mesh/interfaces.h"

#include <algorithm>
#include <string>

namespace subvol {

using namespace internal;

namespace {

/// Numbers samples when a face first asks for them.
class BoundarySampler {
 public:
  BoundarySampler(const ElementSpace& space, int intervals)
      : space_(space),
        n_(intervals),
        vertex_samples_(space.num_vertices(), kNoIndex),
        edge_samples_(space.topology().num_edges(), kNoIndex) {}

  void add_faces(std::span<const Index> faces) {
    for (const Index f : faces) {
      begin_face(f);
      if (corners_.size() == 4)
        sample_quad(f);
      else
        sample_triangle(f);
    }
  }

  /// Returns false if the edge belongs to no face that was added.
  bool add_edge(Index e, bool forward = true) {
    const auto& [low, high] = space_.topology().edge(e);
    if (vertex_samples_[low] == kNoIndex || vertex_samples_[high] == kNoIndex ||
        (n_ > 1 && edge_samples_[e] == kNoIndex))
      return false;
    for (int i = 0; i < n_; ++i)
      samples_.crease_edges.push_back(
          {edge_sample(e, forward ? i : n_ - i), edge_sample(e, forward ? i + 1 : n_ - i - 1)});
    return true;
  }

  BoundarySamples take() {
    samples_.positions = point_map(space_, samples_.points);
    return std::move(samples_);
  }

 private:
  void begin_face(Index f) {
    cell_ = space_.topology().face_cells(f)[0];
    corners_ = space_.topology().face(f);
    const auto vertices = space_.vertices(cell_);
    for (std::size_t i = 0; i < corners_.size(); ++i)
      corner_points_[i] = canonical_vertices(
          space_.kind(cell_))[std::find(vertices.begin(), vertices.end(), corners_[i]) - vertices.begin()];
  }

  Index add(const Vec3& point) {
    samples_.points.push_back({cell_, point});
    return static_cast<Index>(samples_.points.size() - 1);
  }

  /// A point of the face, s steps from corner 0 toward corner 1 and t steps toward the last corner.
  Vec3 point(int s, int t) const {
    const Vec3& origin = corner_points_[0];
    return origin + (static_cast<double>(s) / n_) * (corner_points_[1] - origin) +
           (static_cast<double>(t) / n_) * (corner_points_[corners_.size() - 1] - origin);
  }

  /// The sample `step` intervals from corner a to corner b of the face.
  Index border(std::size_t a, std::size_t b, int step) {
    if (step == 0 || step == n_) {
      const std::size_t corner = step == 0 ? a : b;
      Index& sample = vertex_samples_[corners_[corner]];
      if (sample == kNoIndex) sample = add(corner_points_[corner]);
      return sample;
    }
    const Index e = space_.topology().find_edge(corners_[a], corners_[b]);
    if (edge_samples_[e] == kNoIndex) {
      edge_samples_[e] = static_cast<Index>(samples_.points.size());
      const auto [low, high] = corners_[a] < corners_[b] ? std::pair(a, b) : std::pair(b, a);
      for (int i = 1; i < n_; ++i)
        add(corner_points_[low] + (static_cast<double>(i) / n_) * (corner_points_[high] - corner_points_[low]));
    }
    return edge_sample(e, corners_[a] < corners_[b] ? step : n_ - step);
  }

  /// The sample 0 .. n along an edge from its smaller vertex; all of them exist.
  Index edge_sample(Index e, int step) const {
    const auto& [low, high] = space_.topology().edge(e);
    if (step == 0) return vertex_samples_[low];
    return step == n_ ? vertex_samples_[high] : edge_samples_[e] + step - 1;
  }

  void add_triangle(Index f, Index a, Index b, Index c, bool at_edge) {
    samples_.triangles.push_back({a, b, c});
    samples_.triangle_faces.push_back(f);
    samples_.at_edges.push_back(at_edge);
  }

  Index& grid(int s, int t) { return grid_[t * (n_ + 1) + s]; }

  void sample_quad(Index f) {
    grid_.assign((n_ + 1) * (n_ + 1), kNoIndex);
    for (int i = 0; i <= n_; ++i) {
      grid(i, 0) = border(0, 1, i);
      grid(n_, i) = border(1, 2, i);
      grid(i, n_) = border(3, 2, i);
      grid(0, i) = border(0, 3, i);
    }
    for (int t = 1; t < n_; ++t)
      for (int s = 1; s < n_; ++s) grid(s, t) = add(point(s, t));
    for (int t = 0; t < n_; ++t)
      for (int s = 0; s < n_; ++s) {
        const bool at_edge = s == 0 || t == 0 || s == n_ - 1 || t == n_ - 1;
        add_triangle(f, grid(s, t), grid(s + 1, t), grid(s + 1, t + 1), at_edge);
        add_triangle(f, grid(s, t), grid(s + 1, t + 1), grid(s, t + 1), at_edge);
      }
  }

  void sample_triangle(Index f) {
    grid_.assign((n_ + 1) * (n_ + 1), kNoIndex);
    for (int i = 0; i <= n_; ++i) {
      grid(i, 0) = border(0, 1, i);
      grid(n_ - i, i) = border(1, 2, i);
      grid(0, i) = border(0, 2, i);
    }
    for (int t = 1; t < n_; ++t)
      for (int s = 1; s + t < n_; ++s) grid(s, t) = add(point(s, t));
    for (int t = 0; t < n_; ++t)
      for (int s = 0; s + t < n_; ++s) {
        const bool at_edge = s == 0 || t == 0;
        add_triangle(f, grid(s, t), grid(s + 1, t), grid(s, t + 1), at_edge || s + t == n_ - 1);
        if (s + t + 1 < n_)
          add_triangle(f, grid(s + 1, t), grid(s + 1, t + 1), grid(s, t + 1), at_edge || s + t == n_ - 2);
      }
  }

  const ElementSpace& space_;
  int n_;
  std::vector<Index> vertex_samples_, edge_samples_;  // per edge, the first inside
  BoundarySamples samples_;
  Index cell_ = kNoIndex;
  std::span<const Index> corners_;
  std::array<Vec3, 4> corner_points_;
  std::vector<Index> grid_;
};

void require_intervals(const char* function, int intervals) {
  if (intervals < 1)
    throw InputError(std::string(function) + ": intervals must be at least 1, got " + std::to_string(intervals));
}

/// Returns the number of an edge; kNoIndex if there is none between these vertices, or no such vertex.
Index edge_between(const MeshTopology& topology, Index v0, Index v1) {
  const auto num_vertices = static_cast<Index>(topology.num_vertices());
  const bool known = v0 >= 0 && v1 >= 0 && v0 < num_vertices && v1 < num_vertices;
  return known ? topology.find_edge(v0, v1) : kNoIndex;
}

void require_numbers(const char* what, std::span<const Index> numbers, std::size_t limit) {
  for (const Index i : numbers)
    if (i < 0 || static_cast<std::size_t>(i) >= limit)
      throw InputError(std::string("make_face_samples: ") + what + ' ' + std::to_string(i) + " of " +
                       std::to_string(limit));
}

}  // namespace

BoundarySamples make_boundary_samples(const ElementSpace& space, int intervals, std::span<const CreaseEdge> creases) {
  require_intervals("make_boundary_samples", intervals);
  const MeshTopology& topology = space.topology();
  BoundarySampler sampler(space, intervals);
  sampler.add_faces(topology.boundary_faces());
  for (const CreaseEdge& crease : creases) {
    const Index e = edge_between(topology, crease.v0, crease.v1);
    if (e == kNoIndex || !topology.is_boundary_edge(e))
      throw InputError("make_boundary_samples: crease " + std::to_string(crease.v0) + ' ' + std::to_string(crease.v1) +
                       " is no edge of the boundary");
    sampler.add_edge(e, crease.v0 < crease.v1);
  }
  return sampler.take();
}

BoundarySamples make_face_samples(const ElementSpace& space, std::span<const Index> faces, int intervals,
                                  std::span<const Index> edges) {
  require_intervals("make_face_samples", intervals);
  require_numbers("face", faces, space.topology().num_faces());
  require_numbers("edge", edges, space.topology().num_edges());
  BoundarySampler sampler(space, intervals);
  sampler.add_faces(faces);
  for (const Index e : edges)
    if (!sampler.add_edge(e))
      throw InputError("make_face_samples: edge " + std::to_string(e) + " belongs to none of the faces");
  return sampler.take();
}

BoundarySamples make_sheet_samples(const ElementSpace& space, const VolumeMesh& mesh, int intervals,
                                   std::span<const CreaseEdge> creases) {
  const MeshTopology& topology = space.topology();
  const Interfaces interfaces = find_interfaces(mesh, topology);
  if (interfaces.empty()) return make_boundary_samples(space, intervals, creases);
  std::vector<Index> faces(topology.boundary_faces().begin(), topology.boundary_faces().end()), edges;
  faces.insert(faces.end(), interfaces.faces.begin(), interfaces.faces.end());
  for (const CreaseEdge& crease : creases) edges.push_back(topology.find_edge(crease.v0, crease.v1));
  BoundarySamples samples = make_face_samples(space, faces, intervals, edges);
  for (std::size_t t = 0; t < samples.triangles.size(); ++t) {
    const auto [first, second] = topology.face_cells(samples.triangle_faces[t]);
    if (second != kNoIndex && mesh.references[first] > mesh.references[second])
      std::swap(samples.triangles[t][1], samples.triangles[t][2]);
  }
  return samples;
}

EdgeSamples make_edge_samples(const ElementSpace& space, std::span<const CreaseEdge> edges, int intervals) {
  require_intervals("make_edge_samples", intervals);
  const MeshTopology& topology = space.topology();
  std::vector<Index> cell_of_edge(topology.num_edges());
  for (std::size_t c = 0; c < space.num_cells(); ++c)
    for (const Index e : topology.cell_edges(c)) cell_of_edge[e] = static_cast<Index>(c);
  EdgeSamples samples;
  std::vector<CellPoint> points;
  for (const auto& [v0, v1, sharpness] : edges) {
    const Index e = edge_between(topology, v0, v1);
    if (e == kNoIndex)
      throw InputError("make_edge_samples: " + std::to_string(v0) + ' ' + std::to_string(v1) + " is no edge");
    const Index cell = cell_of_edge[e];
    const auto point = [&](Index v) {
      const auto vertices = space.vertices(cell);
      return canonical_vertices(space.kind(cell))[std::ranges::find(vertices, v) - vertices.begin()];
    };
    const Vec3 from = point(v0), to = point(v1);
    for (int i = 0; i <= intervals; ++i) {
      if (i > 0) {
        const auto last = static_cast<Index>(points.size());
        samples.segments.push_back({last - 1, last});
      }
      points.push_back({cell, from + (static_cast<double>(i) / intervals) * (to - from)});
    }
  }
  samples.positions = point_map(space, points);
  return samples;
}

}  // namespace subvol
