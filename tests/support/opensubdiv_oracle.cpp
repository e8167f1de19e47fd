// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/opensubdiv_oracle.h"

#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"

#include <Eigen/Geometry>

#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>

#include <algorithm>
#include <array>
#include <memory>

namespace subvol::test {

namespace {

namespace osd = OpenSubdiv;

/// A position as OpenSubdiv's primvar refiner wants it.
struct Point {
  Vec3 value = Vec3::Zero();
  void Clear(void* = nullptr) { value.setZero(); }
  void AddWithWeight(const Point& other, double weight) { value += weight * other.value; }
};

struct Boundary {
  std::vector<Index> vertices;
  std::vector<Point> points;
  std::unique_ptr<osd::Far::TopologyRefiner> refiner;
};

Boundary make_boundary(const VolumeMesh& mesh, OracleFaces which = OracleFaces::boundary) {
  const MeshTopology topology(mesh);
  Boundary boundary;
  std::vector<std::vector<Index>> faces;
  for (const Index f : topology.boundary_faces()) faces.emplace_back(topology.face(f).begin(), topology.face(f).end());
  if (which == OracleFaces::sheets)
    for (const Index f : internal::find_interfaces(mesh, topology).faces) {
      const std::array<Index, 4> face = internal::oriented_face(mesh, topology, f);
      faces.emplace_back(face.begin(), std::ranges::find(face, kNoIndex));
    }
  std::vector<Index> numbers(mesh.num_vertices(), kNoIndex);
  for (const auto& face : faces)
    for (const Index v : face) numbers[v] = 0;
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
    if (numbers[v] != kNoIndex) {
      numbers[v] = static_cast<Index>(boundary.vertices.size());
      boundary.vertices.push_back(static_cast<Index>(v));
      boundary.points.push_back({mesh.positions[v]});
    }
  std::vector<int> sizes, corners, crease_pairs, corner_indices;
  std::vector<float> crease_weights, corner_weights;
  for (const auto& face : faces) {
    sizes.push_back(static_cast<int>(face.size()));
    for (const Index v : face) corners.push_back(numbers[v]);
  }
  for (const CreaseEdge& crease : mesh.tags.creases) {
    crease_pairs.insert(crease_pairs.end(), {numbers[crease.v0], numbers[crease.v1]});
    crease_weights.push_back(static_cast<float>(crease.sharpness));
  }
  for (const CornerVertex& corner : mesh.tags.corners) {
    corner_indices.push_back(numbers[corner.vertex]);
    corner_weights.push_back(static_cast<float>(corner.sharpness));
  }
  osd::Far::TopologyDescriptor descriptor;
  descriptor.numVertices = static_cast<int>(boundary.vertices.size());
  descriptor.numFaces = static_cast<int>(sizes.size());
  descriptor.numVertsPerFace = sizes.data();
  descriptor.vertIndicesPerFace = corners.data();
  descriptor.numCreases = static_cast<int>(crease_weights.size());
  descriptor.creaseVertexIndexPairs = crease_pairs.data();
  descriptor.creaseWeights = crease_weights.data();
  descriptor.numCorners = static_cast<int>(corner_weights.size());
  descriptor.cornerVertexIndices = corner_indices.data();
  descriptor.cornerWeights = corner_weights.data();
  using Factory = osd::Far::TopologyRefinerFactory<osd::Far::TopologyDescriptor>;
  osd::Sdc::Options scheme;
  scheme.SetVtxBoundaryInterpolation(osd::Sdc::Options::VTX_BOUNDARY_EDGE_ONLY);
  boundary.refiner.reset(Factory::Create(descriptor, Factory::Options(osd::Sdc::SCHEME_CATMARK, scheme)));
  return boundary;
}

std::vector<std::vector<Point>> refine(Boundary& boundary, int levels) {
  osd::Far::TopologyRefiner::UniformOptions options(levels);
  options.fullTopologyInLastLevel = true;
  boundary.refiner->RefineUniform(options);
  const osd::Far::PrimvarRefinerReal<double> primvars(*boundary.refiner);
  std::vector<std::vector<Point>> points{boundary.points};
  for (int level = 1; level <= levels; ++level) {
    points.emplace_back(boundary.refiner->GetLevel(level).GetNumVertices());
    primvars.Interpolate(level, points[level - 1], points[level]);
  }
  return points;
}

std::vector<Vec3> values(const std::vector<Point>& points) {
  std::vector<Vec3> result;
  for (const Point& point : points) result.push_back(point.value);
  return result;
}

}  // namespace

OracleLevels oracle_refine(const VolumeMesh& mesh, int levels) {
  Boundary boundary = make_boundary(mesh);
  const auto points = refine(boundary, levels);
  OracleLevels result;
  result.vertices = boundary.vertices;
  for (const auto& level : points) result.positions.push_back(values(level));
  const osd::Far::PrimvarRefinerReal<double> primvars(*boundary.refiner);
  std::vector<Point> limit(points.back().size()), du(points.back().size()), dv(points.back().size());
  primvars.Limit(points.back(), limit, du, dv);
  result.limit_positions = values(limit);
  for (std::size_t i = 0; i < du.size(); ++i)
    result.limit_normals.push_back(du[i].value.cross(dv[i].value).normalized());
  return result;
}

OracleChildren oracle_children(const VolumeMesh& mesh, OracleFaces faces) {
  Boundary boundary = make_boundary(mesh, faces);
  const auto points = refine(boundary, 1);
  const auto& coarse = boundary.refiner->GetLevel(0);
  OracleChildren children;
  children.vertices = boundary.vertices;
  for (int v = 0; v < coarse.GetNumVertices(); ++v)
    children.vertex_children.push_back(points[1][coarse.GetVertexChildVertex(v)].value);
  for (int e = 0; e < coarse.GetNumEdges(); ++e) {
    const auto ends = coarse.GetEdgeVertices(e);
    const Index a = boundary.vertices[ends[0]], b = boundary.vertices[ends[1]];
    children.edges.push_back({std::min(a, b), std::max(a, b)});
    children.edge_children.push_back(points[1][coarse.GetEdgeChildVertex(e)].value);
  }
  return children;
}

}  // namespace subvol::test
