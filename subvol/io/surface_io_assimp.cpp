// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/surface_formats.h"

#include "subvol/base/error.h"
#include "subvol/io/face_labels.h"
#include "subvol/io/position_welder.h"
#include "subvol/io/surface_io.h"

#ifdef SUBVOL_ASSIMP
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/Importer.hpp>
#endif

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>

namespace subvol::internal {

#ifndef SUBVOL_ASSIMP

ParsedSurface parse_scene(const std::string& name, std::string_view) {
  throw InputError(name +
                   ": this program was built without Assimp, which reads such files; install libassimp-dev and "
                   "build it again");
}

#else

namespace {

/// Adds the faces of one mesh, with the material and the name that it has.
void add_mesh(const std::string& name, const aiScene& scene, const aiMesh& part, PositionWelder& welder,
              PolygonMesh& mesh, FaceLabels& labels) {
  const aiMaterial* material =
      part.mMaterialIndex < scene.mNumMaterials ? scene.mMaterials[part.mMaterialIndex] : nullptr;
  const std::string label = material ? material->GetName().C_Str() : "";
  for (unsigned f = 0; f < part.mNumFaces; ++f) {
    const aiFace& face = part.mFaces[f];
    if (face.mNumIndices < 3) continue;  // points and lines
    for (unsigned i = 0; i < face.mNumIndices; ++i) {
      if (face.mIndices[i] >= part.mNumVertices) throw InputError(name + ": a face names a vertex that does not exist");
      const aiVector3D& p = part.mVertices[face.mIndices[i]];
      const Vec3 position(static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z));
      if (!position.allFinite()) throw InputError(name + ": a coordinate that is not finite");
      mesh.face_vertices.push_back(welder.vertex(position));
    }
    mesh.face_offsets.push_back(mesh.face_vertices.size());
    labels.add(label, part.mName.C_Str());
  }
}

}  // namespace

ParsedSurface parse_scene(const std::string& name, std::string_view bytes) {
  Assimp::Importer importer;
  const std::string extension = std::filesystem::path(name).extension().string();
  // Pictures, normals and bones do not matter; nodes put their meshes in their places.
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS,
                              aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS | aiComponent_COLORS |
                                  aiComponent_TEXCOORDS | aiComponent_BONEWEIGHTS | aiComponent_ANIMATIONS |
                                  aiComponent_TEXTURES | aiComponent_LIGHTS | aiComponent_CAMERAS);
  const aiScene* scene = importer.ReadFileFromMemory(
      bytes.data(), bytes.size(),
      aiProcess_RemoveComponent | aiProcess_PreTransformVertices | aiProcess_ValidateDataStructure,
      extension.empty() ? "" : extension.c_str() + 1);
  if (!scene) {
    std::string why = importer.GetErrorString();
    std::ranges::replace(why, '\n', ' ');
    throw InputError(name + ": not a file that can be read: " + why);
  }
  ParsedSurface parsed;
  PositionWelder welder;
  FaceLabels labels;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m)
    add_mesh(name, *scene, *scene->mMeshes[m], welder, parsed.mesh, labels);
  parsed.mesh.positions = welder.take(parsed.mesh.face_vertices);
  parsed.mesh.face_groups = labels.groups();
  return parsed;
}

#endif

}  // namespace subvol::internal

bool subvol::has_assimp() {
#ifdef SUBVOL_ASSIMP
  return true;
#else
  return false;
#endif
}
