// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/read_back.h"

#include "subvol/base/error.h"
#include "subvol/export/cutaway.h"
#include "subvol/export/gltf_writer.h"
#include "subvol/export/obj_writer.h"
#include "subvol/export/usd_writer.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/nodal_mesh.h"
#include "subvol/io/nodal_writers.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <functional>
#include <limits>

#include <sys/stat.h>

using namespace subvol;
using namespace subvol::test;
using Catch::Contains;

namespace {

/// Hexes, prisms and tets with references and tags, in an order that no format keeps.
VolumeMesh tagged_mesh() {
  PointSource source(1);
  VolumeMesh mesh = renumbered(mixed_cells(), source.random());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) mesh.references.push_back(static_cast<int>(c % 2) + 1);
  const MeshTopology topology(mesh);
  const auto edge = topology.face(topology.boundary_faces()[0]);
  mesh.tags.creases.push_back({std::min(edge[0], edge[1]), std::max(edge[0], edge[1]), 1.5});
  mesh.tags.corners.push_back({edge[0], kInfiniteSharpness});
  return mesh;
}

HighOrderMesh curved_mesh(const VolumeMesh& mesh) {
  PointSource source(2);
  HighOrderMesh curved(ElementSpace(mesh, Basis::legendre, 2), mesh);
  for (std::size_t i = mesh.num_vertices(); i < curved.coefficients.size(); ++i)
    curved.coefficients[i] += 0.01 * source.vector();
  return curved;
}

/// Every spoilt thing is told from the file.
template <class Thing>
void tells(const std::filesystem::path& path, const Thing& written,
           std::initializer_list<std::function<void(Thing&)>> spoilers) {
  CHECK_NOTHROW(require_written(path, written));
  for (const auto& spoil : spoilers) {
    Thing other = written;
    spoil(other);
    CHECK_THROWS_AS(require_written(path, other), IoError);
    CHECK_THROWS_WITH(require_written(path, other), Contains(path.filename().string()));
  }
}

}  // namespace

TEST_CASE("cells that were written are told from cells that differ in anything") {
  const TemporaryFolder folder;
  const VolumeMesh mesh = tagged_mesh();
  const auto moved = [](VolumeMesh& m) { m.positions[3].y() = std::nextafter(m.positions[3].y(), 9.0); };
  const auto turned = [](VolumeMesh& m) { std::swap(m.cell_vertices[0], m.cell_vertices[1]); };
  const auto fewer = [](VolumeMesh& m) {
    m.kinds.pop_back();
    m.cell_offsets.pop_back();
    m.cell_vertices.resize(m.cell_offsets.back());
    m.references.pop_back();
  };
  const auto more = [](VolumeMesh& m) { m.positions.push_back(Vec3::Zero()); };
  const auto other_reference = [](VolumeMesh& m) { m.references[0] += 7; };
  for (const char* name : {"a.mesh", "a.vtk"}) {
    write_volume_mesh(folder / name, mesh);
    tells<VolumeMesh>(folder / name, mesh, {moved, turned, fewer, more, other_reference});
  }
  tells<VolumeMesh>(
      folder / "a.mesh", mesh,
      {[](VolumeMesh& m) { m.tags.creases[0].sharpness = 2; }, [](VolumeMesh& m) { m.tags.corners.clear(); }});
  for (const char* name : {"a.vtu", "a.msh"}) {
    write_volume(folder / name, mesh, {});
    tells<VolumeMesh>(folder / name, mesh, {moved, turned, fewer, more});
  }
}

TEST_CASE("references of ten digits come back from a .bdf of cells of both orders") {
  const TemporaryFolder folder;
  VolumeMesh mesh = lattice(2, 2, 1);
  mesh.references = {123456789, 123456780, std::numeric_limits<int>::max(), 12345678};
  write_volume(folder / "a.bdf", mesh);
  CHECK_NOTHROW(require_written(folder / "a.bdf", mesh));
  CHECK(read_nodal_mesh(folder / "a.bdf").references == mesh.references);
  const HighOrderMesh curved = curved_mesh(mesh);
  const HighOrderFileOptions options{.references = mesh.references};
  write_volume(folder / "c.bdf", curved, options);
  CHECK_NOTHROW(require_written(folder / "c.bdf", curved, options));
  CHECK(read_nodal_mesh(folder / "c.bdf").references == mesh.references);
}

TEST_CASE("regions with names like those of references stay apart in every format") {
  const TemporaryFolder folder;
  VolumeMesh mesh = lattice(2, 2, 1);
  mesh.references = {3, 11, 7, 7};
  mesh.regions = {{"A_B", 3, 3}, {"reference 7", 11, 3}};
  for (const char* name : {"a.msh", "a.inp", "a.e", "a.vtu", "a.mesh"}) {
    if (name == std::string("a.e") && !has_exodus()) continue;
    if (name == std::string("a.mesh"))
      write_volume_mesh(folder / name, mesh);
    else
      write_volume(folder / name, mesh);
    CAPTURE(name);
    CHECK_NOTHROW(require_written(folder / name, mesh));
    const NodalMesh found = name == std::string("a.mesh") ? internal::nodal_mesh(read_volume_mesh(folder / name))
                                                          : read_nodal_mesh(folder / name);
    std::vector<int> references = found.references;
    std::sort(references.begin(), references.end());
    CHECK(references == std::vector{3, 7, 7, 11});
  }
  write_volume(folder / "old.msh", mesh, {}, {}, MshVersion::v2_2);
  CHECK(read_nodal_mesh(folder / "old.msh").regions == mesh.regions);
}

TEST_CASE("names of regions that are equal, or continue another one's, come back from Exodus") {
  if (!has_exodus()) return;
  const TemporaryFolder folder;
  VolumeMesh mesh = mixed_cells();
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) mesh.references.push_back(c < 2 ? 1 : 2);
  mesh.regions = {{"core", 1, 3}, {"core", 2, 3}};
  write_volume(folder / "a.e", mesh);
  CHECK_NOTHROW(require_written(folder / "a.e", mesh));
  CHECK(read_nodal_mesh(folder / "a.e").regions == mesh.regions);
  VolumeMesh cubes = lattice(2, 1, 1);
  cubes.references = {1, 2};
  cubes.regions = {{"core", 1, 3}, {"core_hexes", 2, 3}};
  write_volume(folder / "b.e", cubes);
  CHECK_NOTHROW(require_written(folder / "b.e", cubes));
  CHECK(read_nodal_mesh(folder / "b.e").references == cubes.references);
}

TEST_CASE("cells whose coordinates have too few digits in a file are told, with what to do") {
  const TemporaryFolder folder;
  VolumeMesh mesh = lattice(2, 2, 1);
  for (Vec3& p : mesh.positions) p = 0.3 * p + Vec3(1e6, -1e6, 1e6);
  for (const char* name : {"near.bdf", "near.inp"}) {
    write_volume(folder / name, mesh);
    CHECK_NOTHROW(require_written(folder / name, mesh));
  }
  for (std::size_t v = 0; v < mesh.positions.size(); ++v)
    mesh.positions[v] = Vec3::Constant(1e14) + 0.5 * lattice(2, 2, 1).positions[v];
  write_volume(folder / "far.bdf", mesh);
  CHECK_THROWS_WITH(require_written(folder / "far.bdf", mesh),
                    Contains("moved by") && Contains("more digits") && Contains(".msh"));
}

TEST_CASE("curved cells that were written are told from others") {
  const TemporaryFolder folder;
  const VolumeMesh straight = tagged_mesh();
  const HighOrderMesh mesh = curved_mesh(straight);
  const HighOrderFileOptions options{.references = straight.references};
  for (const char* name : {"a.vtu", "a.msh", "a.mesh", "a.vtk"}) {
    write_volume(folder / name, mesh, options);
    CHECK_NOTHROW(require_written(folder / name, mesh, options));
    HighOrderMesh other = mesh;
    other.coefficients[mesh.space.num_vertices()].x() += 1e-9;  // in the midst of an edge
    CHECK_THROWS_WITH(require_written(folder / name, other, options), Contains(name));
  }
}

TEST_CASE("surfaces and scenes that were written are told from others") {
  const TemporaryFolder folder;
  VolumeMesh mesh = lattice(2, 2, 2);
  for (Vec3& p : mesh.positions) p /= 3;
  const PolygonMesh surface = boundary_surface(mesh, MeshTopology(mesh));
  write_obj(folder / "a.obj", surface);
  write_usd(folder / "a.usda", surface, {});
  for (const char* name : {"a.obj", "a.usda"})
    tells<PolygonMesh>(folder / name, surface,
                       {[](PolygonMesh& m) { m.positions[1].z() += 1e-12; },
                        [](PolygonMesh& m) { std::swap(m.face_vertices[2], m.face_vertices[3]); },
                        [](PolygonMesh& m) { m.positions.pop_back(); }});
  Scene scene = cutaway_scene(mesh, std::vector<double>(mesh.num_cells(), 1));
  SceneShape shape{"before", scene.nodes[0].primitive.positions, scene.nodes[0].primitive.normals};
  scene.nodes[0].shapes = {shape};
  for (const bool quantize : {false, true})
    for (const char* name : {"a.glb", "a.gltf"}) {
      scene.quantize = quantize;
      write_gltf(folder / name, scene);
      tells<Scene>(folder / name, scene,
                   {[](Scene& s) { s.nodes[0].primitive.positions[2].x() += 1e-4; },
                    [](Scene& s) { std::swap(s.nodes[0].primitive.indices[0], s.nodes[0].primitive.indices[1]); },
                    [](Scene& s) { s.nodes.pop_back(); }, [](Scene& s) { s.nodes[1].name = "other"; },
                    [](Scene& s) { s.nodes[0].shapes.clear(); }});
    }
}

TEST_CASE("names of groups and regions may be words of the format") {
  const TemporaryFolder folder;
  VolumeMesh mesh = lattice(2, 1, 1);
  for (const Vec3& shift : {Vec3(0, 0, 0), Vec3(100, 0, 0)}) {
    for (Vec3& p : mesh.positions) p += shift;
    const MeshTopology topology(mesh);
    for (const std::string name :
         {"a $Nodes b", "$Elements", "x double3 xformOp:translate y", " int[] faceVertexCounts = [",
          "point3f[] points = (", "v 1 2 3", "End", "<DataArray Name=\"Points\">", "solid"}) {
      CAPTURE(name, shift);
      mesh.references = {1, 2};
      mesh.regions = {{name, 2, 3}};
      mesh.face_groups = {{{name, 1, 2}}, {{face_key(topology.face(topology.boundary_faces()[0])), 0}}};
      for (const char* file : {"a.msh", "a.vtu", "a.inp", "a.bdf", "a.mfem"}) {
        write_volume(folder / file, mesh);
        CHECK_NOTHROW(require_written(folder / file, mesh));
      }
      write_volume(folder / "old.msh", mesh, {}, {}, MshVersion::v2_2);
      CHECK_NOTHROW(require_written(folder / "old.msh", mesh, MshVersion::v2_2));
      write_volume_mesh(folder / "a.mesh", mesh);
      CHECK_NOTHROW(require_written(folder / "a.mesh", mesh));
      const PolygonMesh surface = boundary_surface(mesh, topology, nullptr);
      REQUIRE(!surface.face_groups.empty());
      write_usd(folder / "a.usda", surface, {});
      CHECK_NOTHROW(require_written(folder / "a.usda", surface));
      write_obj(folder / "a.obj", surface);
      CHECK_NOTHROW(require_written(folder / "a.obj", surface));
    }
  }
}

TEST_CASE("what is written is read without warnings") {
  const TemporaryFolder folder;
  VolumeMesh mesh = lattice(2, 2, 1);
  for (const int kind : {0, 1, 2}) {
    mesh.references = kind == 0 ? std::vector<int>{} : std::vector{3, 4, 3, 5};
    if (kind == 2) mesh.regions = {{"core", 3, 3}, {"shell", 4, 3}};
    const Group first = kind == 2 ? Group{"wall", 7, 2} : Group{"", 7, 2};
    const MeshTopology topology(mesh);
    const auto faces = topology.boundary_faces();
    mesh.face_groups = {{first, {"", 9, 2}},
                        {{face_key(topology.face(faces[0])), 0}, {face_key(topology.face(faces[3])), 1}}};
    normalize(mesh.face_groups);
    const HighOrderMesh curved = curved_mesh(mesh);
    const std::vector<double> minima(4, 0.5);
    const HighOrderFileOptions options{.cell_minima = minima,
                                       .references = mesh.references,
                                       .face_groups = &mesh.face_groups,
                                       .regions = mesh.regions};
    for (const char* name : {"a.msh", "a.vtu", "a.inp", "a.bdf", "a.mfem", "a.e"}) {
      if (name == std::string("a.e") && !has_exodus()) continue;
      CAPTURE(name, kind);
      write_volume(folder / name, mesh, minima);
      CHECK(read_nodal_mesh(folder / name).warnings == std::vector<std::string>{});
      write_volume(folder / name, curved, options);
      CHECK(read_nodal_mesh(folder / name).warnings == std::vector<std::string>{});
    }
  }
}

TEST_CASE("a file that is gone or cut off is an error, one that is no file is passed over") {
  const TemporaryFolder folder;
  const VolumeMesh mesh = tagged_mesh();
  for (const char* name : {"a.mesh", "a.vtk", "a.vtu", "a.msh"}) {
    const auto path = folder / name;
    CHECK_THROWS_AS(require_written(path, mesh), IoError);
    const bool linear = path.extension() == ".mesh" || path.extension() == ".vtk";
    linear ? write_volume_mesh(path, mesh) : write_volume(path, mesh, {});
    const std::string bytes = content_of(path);
    folder.file(name, bytes.substr(0, bytes.size() / 2));
    CHECK_THROWS_AS(require_written(path, mesh), IoError);
  }
  REQUIRE(mkfifo((folder / "pipe.mesh").c_str(), 0600) == 0);
  CHECK_NOTHROW(require_written(folder / "pipe.mesh", mesh));
}
