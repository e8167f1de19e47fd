// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/subdivision/limit_surface.h"
#include "subvol/surface/surface_topology.h"

#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/bfr/surface.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <string>

namespace subvol {

namespace {

namespace far = OpenSubdiv::Far;
namespace bfr = OpenSubdiv::Bfr;

constexpr int kApproximationLevel = 8;  // isolation level; normals at extraordinary vertices are accurate to 1e-5

std::unique_ptr<far::TopologyRefiner> make_refiner(const SurfaceTopology& surface) {
  std::vector<int> sizes, crease_ends, corners;
  std::vector<float> crease_weights, corner_weights;
  for (std::size_t f = 0; f < surface.num_faces(); ++f) sizes.push_back(surface.face_size(static_cast<Index>(f)));
  for (std::size_t e = 0; e < surface.num_edges(); ++e) {
    if (!(surface.edge_sharpness[e] > 0)) continue;
    const Index h = surface.edge_corners[e];
    crease_ends.push_back(surface.corner_vertices[h]);
    crease_ends.push_back(surface.corner_vertices[surface.next(h)]);
    crease_weights.push_back(surface.edge_sharpness[e]);
  }
  for (std::size_t v = 0; v < surface.num_vertices(); ++v) {
    if (!(surface.vertex_sharpness[v] > 0)) continue;
    corners.push_back(static_cast<int>(v));
    corner_weights.push_back(surface.vertex_sharpness[v]);
  }
  far::TopologyDescriptor descriptor;
  descriptor.numVertices = static_cast<int>(surface.num_vertices());
  descriptor.numFaces = static_cast<int>(surface.num_faces());
  descriptor.numVertsPerFace = sizes.data();
  descriptor.vertIndicesPerFace = surface.corner_vertices.data();
  descriptor.numCreases = static_cast<int>(crease_weights.size());
  descriptor.creaseVertexIndexPairs = crease_ends.data();
  descriptor.creaseWeights = crease_weights.data();
  descriptor.numCorners = static_cast<int>(corners.size());
  descriptor.cornerVertexIndices = corners.data();
  descriptor.cornerWeights = corner_weights.data();
  using Factory = far::TopologyRefinerFactory<far::TopologyDescriptor>;
  return std::unique_ptr<far::TopologyRefiner>(
      Factory::Create(descriptor, Factory::Options(OpenSubdiv::Sdc::SCHEME_CATMARK, OpenSubdiv::Sdc::Options())));
}

bfr::SurfaceFactory::Options factory_options() {
  bfr::SurfaceFactory::Options options;
  options.SetApproxLevelSmooth(kApproximationLevel);
  options.SetApproxLevelSharp(kApproximationLevel);
  return options;
}

}  // namespace

struct LimitSurface::Implementation {
  using Factory = bfr::RefinerSurfaceFactory<bfr::SurfaceFactoryCache>;

  /// The surface of a face with its patch points, made at its first use.
  struct Patch {
    bfr::Surface<double> surface;
    std::vector<double> points;
  };

  explicit Implementation(const BoundarySurface& boundary, std::span<const Vec3> control)
      : refiner(make_refiner(boundary.topology)), factory(*refiner, factory_options()) {
    for (Index v : boundary.vertices) positions.insert(positions.end(), control[v].data(), control[v].data() + 3);
    patches.resize(boundary.faces.size());
  }

  const Patch& patch(Index face) {
    std::unique_ptr<Patch>& patch = patches[face];
    if (patch) return *patch;
    patch = std::make_unique<Patch>();
    factory.InitVertexSurface(face, &patch->surface);
    const bfr::Surface<double>::PointDescriptor triples(3);
    patch->points.resize(3 * static_cast<std::size_t>(patch->surface.GetNumPatchPoints()));
    patch->surface.PreparePatchPoints(positions.data(), triples, patch->points.data(), triples);
    return *patch;
  }

  std::unique_ptr<far::TopologyRefiner> refiner;
  Factory factory;
  std::vector<double> positions;
  std::vector<std::unique_ptr<Patch>> patches;
};

LimitSurface::LimitSurface(const VolumeMesh& mesh) {
  const BoundarySurface boundary = tagged_boundary(mesh, MeshTopology(mesh));
  for (std::size_t f = 0; f < boundary.faces.size(); ++f)
    if (boundary.topology.face_size(static_cast<Index>(f)) != 4)
      throw InputError("LimitSurface: boundary face " + std::to_string(f) + " is no quad; subdivide the mesh once");
  implementation_ = std::make_unique<Implementation>(boundary, mesh.positions);
}

LimitSurface::~LimitSurface() = default;
LimitSurface::LimitSurface(LimitSurface&&) noexcept = default;
LimitSurface& LimitSurface::operator=(LimitSurface&&) noexcept = default;

std::size_t LimitSurface::num_faces() const { return implementation_->patches.size(); }

LimitPoint LimitSurface::evaluate(Index face, double u, double v) const {
  if (face < 0 || static_cast<std::size_t>(face) >= num_faces())
    throw InputError("LimitSurface::evaluate: face " + std::to_string(face) + " of " + std::to_string(num_faces()));
  if (!(u >= 0 && u <= 1 && v >= 0 && v <= 1)) throw InputError("LimitSurface::evaluate: u and v must lie in [0, 1]");
  const Implementation::Patch& patch = implementation_->patch(face);
  const double uv[2] = {u, v};
  LimitPoint point;
  patch.surface.Evaluate(uv, patch.points.data(), bfr::Surface<double>::PointDescriptor(3), point.position.data(),
                         point.du.data(), point.dv.data());
  return point;
}

}  // namespace subvol
