// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/surface_formats.h"

#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/face_labels.h"
#include "subvol/io/left_out.h"
#include "subvol/io/position_welder.h"
#include "subvol/io/scene_nodes.h"
#include "subvol/io/surface_io.h"

#ifdef SUBVOL_ASSIMP
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/Importer.hpp>
#endif

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <set>

namespace subvol::internal {

#ifndef SUBVOL_ASSIMP

ParsedSurface parse_scene(const std::string& name, std::string_view) {
  throw InputError(name +
                   ": this program was built without Assimp, which reads such files; install libassimp-dev and "
                   "build it again");
}

#else

namespace {

constexpr std::string_view kXmlBlanks = " \t\r\n";

using Transform = Eigen::Transform<double, 3, Eigen::Affine, Eigen::DontAlign>;

class SceneParser {
 public:
  SceneParser(const std::string& name, const aiScene& scene) : name_(name), scene_(scene) {}

  ParsedSurface parse() {
    if (scene_.mRootNode) add_node(*scene_.mRootNode, Transform::Identity());
    ParsedSurface parsed;
    mesh_.positions = welder_.take(mesh_.face_vertices);
    mesh_.face_groups = labels_.groups(left_out_);
    parsed.mesh = std::move(mesh_);
    left_out_.tell(parsed.warnings);
    return parsed;
  }

 private:
  [[noreturn]] void fail(const char* what) const { throw InputError(name_ + ": " + what); }

  void add_node(const aiNode& node, const Transform& above) {
    Transform own = Transform::Identity();
    for (unsigned row = 0; row < 3; ++row)
      for (unsigned column = 0; column < 4; ++column)
        own(static_cast<int>(row), static_cast<int>(column)) = static_cast<double>(node.mTransformation[row][column]);
    const Transform transform = above * own;
    for (unsigned m = 0; m < node.mNumMeshes; ++m) {
      if (node.mMeshes[m] >= scene_.mNumMeshes) fail("a node names a mesh that does not exist");
      const aiMesh& mesh = *scene_.mMeshes[node.mMeshes[m]];
      constexpr std::size_t kMostRepeatedMeshItems = 1 << 25;  // many nodes may share a large mesh
      if (!used_meshes_.insert(node.mMeshes[m]).second)
        num_repeated_ += std::size_t{mesh.mNumVertices} + mesh.mNumFaces;
      if (num_repeated_ > kMostRepeatedMeshItems)
        fail("nodes repeat meshes of more than 33 million vertices and faces in all");
      add_mesh(mesh, node, transform);
    }
    for (unsigned c = 0; c < node.mNumChildren; ++c) add_node(*node.mChildren[c], transform);
  }

  /// Adds the faces of one mesh, with the material that it has and the name of its node.
  void add_mesh(const aiMesh& part, const aiNode& node, const Transform& transform) {
    left_out_.add("texture coordinates", std::size_t{part.mNumVertices} * part.GetNumUVChannels());
    left_out_.add("colors of vertices", std::size_t{part.mNumVertices} * part.GetNumColorChannels());
    left_out_.add("bones", part.mNumBones);
    left_out_.add("morph targets", part.mNumAnimMeshes);
    const aiMaterial* material =
        part.mMaterialIndex < scene_.mNumMaterials ? scene_.mMaterials[part.mMaterialIndex] : nullptr;
    const std::string label = material ? material->GetName().C_Str() : "";
    const std::string object = (node.mName.length > 0 ? node.mName : part.mName).C_Str();
    const bool mirrors = transform.linear().determinant() < 0;
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices < 3) {
        left_out_.add("points and lines");
        continue;
      }
      for (unsigned i = 0; i < face.mNumIndices; ++i) {
        const unsigned v = face.mIndices[mirrors ? face.mNumIndices - 1 - i : i];
        if (v >= part.mNumVertices) fail("a face names a vertex that does not exist");
        const aiVector3D& p = part.mVertices[v];
        const Vec3 position =
            transform * Vec3(static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z));
        if (!position.allFinite()) fail("a coordinate that is not finite");
        mesh_.face_vertices.push_back(welder_.vertex(position));
      }
      mesh_.face_offsets.push_back(mesh_.face_vertices.size());
      labels_.add(label, object);
    }
  }

  const std::string& name_;
  const aiScene& scene_;
  std::set<unsigned> used_meshes_;
  std::size_t num_repeated_ = 0;  ///< vertices and faces of meshes that further nodes use
  PositionWelder welder_;
  PolygonMesh mesh_;
  FaceLabels labels_;
  LeftOut left_out_;
};

/// Returns XML without blanks behind its tags, because Assimp takes no blank before a number.
std::string without_leading_blanks(std::string_view xml) {
  std::string text;
  text.reserve(xml.size());
  bool is_leading = false;
  for (const char c : xml) {
    is_leading = c == '>' || (is_leading && kXmlBlanks.find(c) != std::string_view::npos);
    if (!is_leading || c == '>') text += c;
  }
  return text;
}

/// Refuses COLLADA whose lists of indices hold anything but whole numbers, because Assimp never ends reading these.
void require_whole_indices(const std::string& name, std::string_view bytes) {
  constexpr std::string_view kColladaIndexCharacters = "0123456789+- \t\r\n";
  for (const std::string_view tag : {"<p", "<vcount"})
    for (std::size_t at = bytes.find(tag); at != std::string_view::npos; at = bytes.find(tag, at + 1)) {
      const std::size_t open = bytes.find('>', at), behind = at + tag.size();
      if (open == std::string_view::npos) return;
      if ((behind != open && kXmlBlanks.find(bytes[behind]) == std::string_view::npos) || bytes[open - 1] == '/')
        continue;
      const std::size_t end = bytes.find_first_not_of(kColladaIndexCharacters, open + 1);
      if (end == std::string_view::npos) return;
      if (bytes.substr(end, 2) != "</")
        throw InputError(name + ": expected whole numbers in " + std::string(tag) + ">, found " +
                         in_quotes(bytes.substr(end, bytes.find_first_of("< \t\r\n", end + 1) - end)));
    }
}

}  // namespace

ParsedSurface parse_scene(const std::string& name, std::string_view bytes) {
  require_no_utf16(name, bytes);
  Assimp::Importer importer;
  const std::string extension = lower_case(std::filesystem::path(name).extension().string());
  std::string text;
  if (extension == ".dae") {
    require_whole_indices(name, bytes);
    require_sound_collada(name, bytes);
    text = without_leading_blanks(bytes);
    bytes = text;
  } else {
    require_sound_fbx(name, bytes);
  }
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);  // pictures of nodes, if there are no meshes
  const aiScene* scene = importer.ReadFileFromMemory(bytes.data(), bytes.size(), aiProcess_ValidateDataStructure,
                                                     extension.empty() ? "" : extension.c_str() + 1);
  if (!scene) {
    std::string why = importer.GetErrorString();
    std::ranges::replace(why, '\n', ' ');
    throw InputError(name + ": not a file that can be read: " + why);
  }
  return SceneParser(name, *scene).parse();
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
