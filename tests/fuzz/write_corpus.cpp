// SPDX-License-Identifier: GPL-3.0-or-later
// Writes small files of every format for the fuzzers to start from: FOLDER/EXTENSION/NAME.

#include "samples/shapes.h"
#include "subvol/base/atomic_file.h"
#include "subvol/export/gltf_writer.h"
#include "subvol/export/high_order_file.h"
#include "subvol/export/obj_writer.h"
#include "subvol/export/surface_writer.h"
#include "subvol/export/volume_writer.h"
#include "subvol/fit/stages/checkpoint.h"
#include "subvol/io/mesh_io.h"
#include "subvol/surface/boundary.h"

#include <cstdio>
#include <cstring>
#include <exception>

namespace {

using namespace subvol;
using namespace subvol::internal;
namespace fs = std::filesystem;

VolumeMesh small_mesh(CellKind kind) {
  VolumeMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  if (kind == CellKind::hex) mesh.add_cell(kind, std::array<Index, 8>{0, 1, 2, 3, 4, 5, 6, 7});
  if (kind == CellKind::prism) {
    mesh.add_cell(kind, std::array<Index, 6>{0, 1, 2, 4, 5, 6});
    mesh.add_cell(kind, std::array<Index, 6>{0, 2, 3, 4, 6, 7});
  }
  if (kind == CellKind::tet)
    for (const auto& [a, b] : {std::array<Index, 2>{1, 2}, {2, 3}, {3, 7}, {7, 4}, {4, 5}, {5, 1}})
      mesh.add_cell(kind, std::array<Index, 4>{0, a, b, 6});
  if (kind == CellKind::pyramid) mesh.add_cell(kind, std::array<Index, 5>{0, 1, 2, 3, 4});
  mesh.references.assign(mesh.num_cells(), 3);
  mesh.tags.creases = {{0, 1, 2.5}, {1, 2, 100}};
  mesh.tags.corners = {{0, 100}};
  return mesh;
}

void write(const fs::path& folder, const char* name, std::string_view bytes) {
  fs::create_directories(folder);
  write_file_atomically(folder / name, bytes);
}

void write_volumes(const fs::path& folder) {
  for (const CellKind kind : {CellKind::hex, CellKind::prism, CellKind::tet, CellKind::pyramid}) {
    const VolumeMesh mesh = small_mesh(kind);
    const std::string name = cell_topology(kind).name;
    for (const char* extension : {"mesh", "vtk"}) {
      fs::create_directories(folder / extension);
      write_volume_mesh(folder / extension / (name + '.' + extension), mesh);
    }
    for (const char* extension : {"vtu", "msh", "inp", "bdf", "mfem", "e"}) {
      fs::create_directories(folder / extension);
      write_volume(folder / extension / (name + '.' + extension), mesh);
    }
    if (kind == CellKind::pyramid) continue;  // which cannot be curved
    const HighOrderMesh quadratic(ElementSpace(mesh, Basis::legendre, 2), mesh);
    for (const char* extension : {"msh", "inp", "bdf", "mfem", "e"})
      write_volume(folder / extension / (name + "2." + extension), quadratic);
    for (const int order : {1, 3})
      write(folder / "vtu", (name + std::to_string(order)).c_str(),
            vtu_text({ElementSpace(mesh, order == 1 ? Basis::fourier : Basis::legendre, order), mesh}));
  }
  const std::string head = "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n";
  const std::string cell("\0\0\0\4\0\0\0\0\0\0\0\1\0\0\0\2\0\0\0\3", 20), type("\0\0\0\n", 4);
  write(folder / "vtk", "binary",
        head + std::string(96, '\1') + "\nCELLS 1 5\n" + cell + "\nCELL_TYPES 1\n" + type + "\n");
  write(folder / "vtk", "offsets",
        "# vtk DataFile Version 5.1\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n"
        "0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 2 4\nOFFSETS vtktypeint64\n0 4\nCONNECTIVITY "
        "vtktypeint64\n0 1 2 3\nCELL_TYPES 1\n10\n");
}

void write_variants(const fs::path& folder) {
  write(folder / "msh", "old",
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n9 0 0 0\n3 1 0 0\n5 0 1 0\n"
        "4 0 0 1\n$EndNodes\n$Elements\n2\n2 2 2 8 1 9 5 3\n3 4 2 6 1 9 3 5 4\n$EndElements\n");
  write(folder / "msh", "four",
        "$MeshFormat\n4 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n1 0 0 0 1 1 1 1 7 0\n"
        "$EndEntities\n$Nodes\n1 4\n1 3 0 4\n9 0 0 0\n3 1 0 0\n5 0 1 0\n4 0 0 1\n$EndNodes\n"
        "$Elements\n1 1\n1 3 4 1\n2 9 3 5 4\n$EndElements\n");
  write(folder / "inp", "sets",
        "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT,TYPE=C3D4,ELSET=e\n1,1,2,3,4\n"
        "*ELSET,ELSET=g,GENERATE\n1,9,2\n*ELSET,ELSET=s\ng,e\n*SURFACE,NAME=f\ns,S2\n");
  write(folder / "inp", "parts",
        "*PART,NAME=p\n*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT,TYPE=C3D4,ELSET=e\n"
        "1,1,2,3,4\n*NSET,NSET=n\n1,2,3\n*END PART\n*ASSEMBLY,NAME=a\n*INSTANCE,NAME=p-1,PART=p\n"
        "*END INSTANCE\n*INSTANCE,NAME=p-2,PART=p\n2,0,0\n2,0,0,2,0,1,90\n*END INSTANCE\n"
        "*NSET,NSET=h,INSTANCE=p-2\n1\n*SURFACE,NAME=f\np-1.e,S1\np-2.1,S2\n*END ASSEMBLY\n");
  write(folder / "bdf", "systems",
        "CORD2C,5,0,1.,2.,3.,2.,2.,3.\n,1.,3.,3.\nCORD1S,6,1,2,3\nGRDSET,,5\nGRID,1,0,0.,0.,0.\nGRID,2,0,1.,0.,0.\n"
        "=,*(1),=,=,*(1.),=\nGRID,4,6,1.,90.,0.\nCTETRA,1,1,1,2,3,4\n=,*(1),==\n=(2)\nBEGIN BULK\nENDDATA\n");
  write(folder / "bdf", "fields",
        "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID           3              0.    1.+0\n"
        "GRID*                  4\n*                      1.\nCTETRA,1,1,1,2,3,4\n"
        "CTRIA3,2,5,1,2,3\n");
  write(folder / "vtu", "ascii",
        "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\"><UnstructuredGrid><Piece "
        "NumberOfPoints=\"4\" NumberOfCells=\"1\"><Points><DataArray type=\"Float32\" "
        "format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells><DataArray "
        "type=\"Int32\" Name=\"connectivity\">0 1 2 3</DataArray><DataArray type=\"Int32\" "
        "Name=\"offsets\">4</DataArray><DataArray type=\"UInt8\" Name=\"types\">10</DataArray>"
        "</Cells></Piece></UnstructuredGrid></VTKFile>");
}

void write_surfaces(const fs::path& folder) {
  const TriangleMesh tetrahedron{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                 {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
  write(folder / "off", "tetrahedron", samples::off_text(tetrahedron));
  PolygonMesh grouped = as_polygons(tetrahedron);
  grouped.face_groups = {{{"wall", 4}, {"", 7}}, {0, 0, 1, kNoIndex}};
  for (const char* extension : {"stl", "ply", "vtp", "3mf"})
    write(folder / extension, "grouped", surface_bytes(std::string(".") + extension, grouped));
  Scene scene;
  scene.nodes.push_back(
      {"tetrahedron", {.positions = tetrahedron.positions, .indices = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2}}});
  write(folder / "glb", "tetrahedron", gltf_bytes(scene, GltfContainer::glb));
  write(folder / "gltf", "tetrahedron", gltf_bytes(scene, GltfContainer::gltf));
  write(
      folder / "dae", "triangle",
      "<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\"><library_geometries><geometry "
      "id=\"g\"><mesh><source id=\"p\"><float_array id=\"a\" count=\"9\">0 0 0 1 0 0 0 1 0</float_array>"
      "<technique_common><accessor source=\"#a\" count=\"3\" stride=\"3\"><param name=\"X\" type=\"float\"/><param "
      "name=\"Y\" type=\"float\"/><param name=\"Z\" type=\"float\"/></accessor></technique_common></source><vertices "
      "id=\"v\"><input semantic=\"POSITION\" source=\"#p\"/></vertices><triangles count=\"1\"><input "
      "semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><p>0 1 2</p></triangles></mesh></geometry></library_geometries>"
      "<library_visual_scenes><visual_scene id=\"s\"><node><instance_geometry url=\"#g\"/></node></visual_scene>"
      "</library_visual_scenes><scene><instance_visual_scene url=\"#s\"/></scene></COLLADA>");
  write(folder / "fbx", "triangle",
        "; FBX 7.4.0 project file\nFBXHeaderExtension: {\nFBXVersion: 7400\n}\nObjects: {\nGeometry: 1, "
        "\"Geometry::\", \"Mesh\" {\nVertices: *9 {\na: "
        "0,0,0,1,0,0,0,1,0\n}\nPolygonVertexIndex: *3 {\na: 0,1,-3\n}\n}\nModel: 2, \"Model::\", \"Mesh\" {\nVersion: "
        "232\n}\n}\nConnections: {\nC: \"OO\",2,0\nC: \"OO\",1,2\n}\n");
  write(folder / "off", "colors",
        "STCOFF\n# a comment\n3 1 0\n0 0 0 1 1 1 1 .5 .5\n"
        "1 0 0 1 1 1 1 0 0\n0 1 0 0 0 0 1 1 1\n3 0 1 2 9\n");
  write(folder / "obj", "slashes",
        "mtllib a\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
        "vt 0 0\nvn 0 0 1\nf 1/1/1 2//1 -2 -1/1\n");
  fs::create_directories(folder / "obj");
  write_obj(folder / "obj" / "bowl.obj", samples::bowl_surface(1));
  write(folder / "stl", "text",
        "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
        "endloop\nendfacet\nendsolid a\n");
  std::string binary(84 + 2 * 50, '\0');
  const std::uint32_t count = 2;
  std::memcpy(binary.data() + 80, &count, sizeof count);
  const float corners[2][9] = {{0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 0, 0, 0, 1, 0, 0, 0, 1}};
  for (std::size_t t = 0; t < 2; ++t) std::memcpy(binary.data() + 84 + 50 * t + 12, corners[t], sizeof corners[t]);
  write(folder / "stl", "binary", binary);
  const std::string body =
      "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "property double quality\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  write(folder / "ply", "text", "ply\nformat ascii 1.0\ncomment c\n" + body + "0 0 0 1\n1 0 0 2\n0 1 0 3\n3 0 1 2\n");
  for (const bool little : {true, false}) {
    std::string bytes = std::string("ply\nformat binary_") + (little ? "little" : "big") + "_endian 1.0\n" + body;
    const auto put = [&](const void* value, std::size_t size) {
      std::string raw(static_cast<const char*>(value), size);
      bytes += little ? raw : std::string(raw.rbegin(), raw.rend());
    };
    for (const std::array<float, 3>& p : {std::array<float, 3>{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}) {
      for (const float c : p) put(&c, sizeof c);
      const double quality = 1;
      put(&quality, sizeof quality);
    }
    bytes += '\3';
    for (const int v : {0, 1, 2}) put(&v, sizeof v);
    write(folder / "ply", little ? "little" : "big", bytes);
  }
}

/// Segmentations of two voxels in each direction.
void write_label_grids(const fs::path& folder) {
  const std::string labels("\0\1\2\0\1\1\0\2", 8);
  const std::string npy = "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 2, 2), }\n";
  write(folder / "npy", "bytes", std::string("\x93NUMPY\1\0", 8) + static_cast<char>(npy.size()) + '\0' + npy + labels);
  const std::string nrrd = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\n";
  write(folder / "nrrd", "raw", nrrd + "encoding: raw\n\n" + labels);
  write(folder / "nrrd", "text",
        nrrd +
            "space directions: (1,0,0) (0,2,0) (0,0,1)\nspace origin: (1,2,3)\n"
            "encoding: ascii\n\n0 1 2 0 1 1 0 2\n");
  std::string nii(352, '\0');
  const auto put = [&](std::size_t at, const auto& value) { std::memcpy(nii.data() + at, &value, sizeof value); };
  put(0, std::int32_t{348});
  put(40, std::array<std::int16_t, 8>{3, 2, 2, 2, 1, 1, 1, 1});  // dim
  put(70, std::array<std::int16_t, 2>{2, 8});                    // datatype: uint8, bits
  put(76, std::array<float, 8>{1, 1, 2, 1, 1, 1, 1, 1});         // pixdim
  put(108, std::array<float, 2>{352, 1});                        // vox_offset, scl_slope
  std::memcpy(nii.data() + 344, "n+1", 4);
  write(folder / "nii", "bytes", nii + labels);
}

void write_checkpoints(const fs::path& folder) {
  const SolvedStage stage{"level 1", 5, {Vec3(1, 2, 3)}, {MinimizerStop::converged, "why", {{1, 2, 1, 3, 4}}}, 0.5};
  SolvedStage denser = stage;  // cells were given a denser quadrature, twice, and it is not over
  denser.result.stop = MinimizerStop::cancelled;
  denser.result.small_steps = 2;
  denser.result.densified = {{0, 4}, {7}};
  denser.result.densified_at = {Vec3(1, 2, 3), Vec3(4, 5, 6)};
  write(folder / "checkpoint", "one", checkpoint_bytes({{"--levels", "3"}, {"target", "ab"}}, {stage, stage}));
  write(folder / "checkpoint", "denser", checkpoint_bytes({{"--levels", "3"}}, {stage, denser}));
  write(folder / "checkpoint", "empty", checkpoint_bytes({}, {}));
}

void write_points(const fs::path& folder) {
  std::string lines;
  for (int i = 0; i < 12; ++i) {
    const std::string x = std::to_string(i), square = std::to_string(i * i), third = std::to_string(i % 3);
    lines += x + ' ' + square + ' ' + third + (i % 2 ? "\n" : "\r\n");
  }
  write(folder / "xyz", "plain", lines);
  write(folder / "xyz", "columns", "# points\n" + lines + "1e3 -2.5 .5 0 0 1 255\n");
  write(folder / "ply", "points",
        "ply\nformat ascii 1.0\nelement vertex 12\nproperty double x\nproperty double y\nproperty double z\n"
        "end_header\n" +
            lines);
}

void write_program_files(const fs::path& folder) {
  write(folder / "json", "fit", R"({"subvol": "0.1", "command": "fit", "command_line": ["subvol", "a b"],
"input": {"target": {"path": "t.off", "bounding_box_diagonal": 2}, "template": {"path": "t.mesh"}},
"options": {"levels": 1}, "outputs": ["o.mesh", "o.glb"], "stop_reason": "converged", "explanation": "why",
"converged": true, "stages": [{"name": "a", "unknowns": 8, "iterations": 1, "energy": {"surface": 1, "volume": 2},
"history": [{"energy": {"surface": 1, "volume": 0.5, "total": 1.5}}], "seconds": 0.1, "kept": false}],
"initial_distance": {"mean_percent": 1, "max_percent": 2}, "quality": {"cells": 2, "min_scaled_jacobian": 0.5,
"histogram": [0, 1, 3], "worst_cells": [{"cell": 1, "scaled_jacobian": 0.5, "center": [0, 1, 2]}]},
"boundary_self_intersections": 0, "warnings": ["w"], "seconds": {"total": 1}, "peak_memory_bytes": 1000000})");
  write(folder / "json", "shell", R"({"subvol": "0.1", "command": "shell", "valid": true, "thickness": {"inside":
{"asked": {"mean": 1, "min": 1, "max": 1}}}, "input": {"surface": {"path": "s.obj"}}})");
  write(folder / "toml", "flat", "levels = 2 # and\n tolerance=0.5\nforce = true\ncage-only = false\n");
  write(folder / "toml", "tables",
        "[fit]\noutput = [\"a.mesh\", 'b.glb']\ntemplate = \"t.mesh\"\n[shell]\n"
        "side = \"both\"\ngrowth = 1.5\n[check]\njson = true\n[optimize]\n"
        "lambda = 1e-3\ntime-limit = 5\n");
  write(folder / "txt", "thickness", "0.1\n 2e-3 \r\n\n17\n");
}

void write_fits(const fs::path& folder) {
  for (const char what : {'\0', '\1', '\2'})
    for (const char kind : {'\0', '\1', '\2'}) {
      const std::string name{'a', static_cast<char>('0' + what), static_cast<char>('0' + kind)};
      write(folder / "fit", name.c_str(), std::string{what, '\0', kind} + std::string(60, '\0'));
    }
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2) {
    std::fprintf(stderr, "usage: write_corpus FOLDER\n");
    return 2;
  }
  const fs::path folder = argv[1];
  write_volumes(folder);
  write_variants(folder);
  write_surfaces(folder);
  write_label_grids(folder);
  write_points(folder);
  write_checkpoints(folder);
  write_program_files(folder);
  write_fits(folder);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "write_corpus: %s\n", error.what());
  return 1;
}
