// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/binary_value.h"
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/face_labels.h"
#include "subvol/io/left_out.h"
#include "subvol/io/scene_nodes.h"
#include "subvol/io/surface_formats.h"
#include "subvol/io/triangle_welder.h"

#include <tiny_gltf.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <set>
#include <type_traits>

namespace subvol::internal {

namespace {

using Transform = Eigen::Transform<double, 3, Eigen::Affine, Eigen::DontAlign>;

/// Throws InputError if values of JSON are in one another so deep that recursion, as that of tinygltf, would take more
/// than the stack.
void require_shallow_json(const std::string& name, std::string_view json) {
  int depth = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (c == '"')
      in_text = !in_text;
    else if (in_text)
      i += c == '\\';
    else if (c == '[' || c == '{')
      ++depth;
    else if (c == ']' || c == '}')
      --depth;
    if (depth > kMostSceneDepth)
      throw InputError(name + ": values nested more than " + std::to_string(kMostSceneDepth) + " deep");
  }
}

/// Returns the JSON of a binary glTF file, as far as it is there: its length stands in the header of the first part.
std::string_view json_of_binary(std::string_view bytes) {
  constexpr std::size_t kGlbLengthAt = 12, kGlbHeaderBytes = 20;
  if (bytes.size() < kGlbHeaderBytes) return {};
  const double length = decode(bytes.data() + kGlbLengthAt, kUInt32, std::endian::little);
  return bytes.substr(kGlbHeaderBytes, static_cast<std::size_t>(length));
}

bool file_exists(const std::string& path, void*) {
  std::error_code error;
  return std::filesystem::exists(path, error);
}

/// Reads a file that a glTF file names. tinygltf itself would wait for a pipe, and take a folder for a huge file.
bool read_whole_file(std::vector<unsigned char>* content, std::string* errors, const std::string& path, void*) {
  try {
    const std::string bytes = read_file(path);
    content->assign(bytes.begin(), bytes.end());
    return true;
  } catch (const InputError& failure) {
    *errors += failure.what();
    return false;
  }
}

class GltfParser {
 public:
  GltfParser(const std::string& name, std::string_view bytes) : name_(name) { load(bytes); }

  ParsedSurface parse() {
    if (model_.scenes.empty()) {
      std::set<int> children;
      for (const tinygltf::Node& node : model_.nodes) children.insert(node.children.begin(), node.children.end());
      for (int n = 0; n < static_cast<int>(model_.nodes.size()); ++n)
        if (!children.contains(n)) add_node(n, Transform::Identity(), 0);
    } else {
      const std::size_t scene = model_.defaultScene >= 0 ? static_cast<std::size_t>(model_.defaultScene) : 0;
      for (const int node : at(model_.scenes, static_cast<int>(scene), "scene").nodes)
        add_node(node, Transform::Identity(), 0);
    }
    if (welder_.is_empty()) left_out_.add("primitives of points or lines", num_lines_);
    left_out_.add("meshes outside the scene", model_.meshes.size() - used_meshes_.size());
    ParsedSurface parsed{welder_.take(), {}};
    parsed.mesh.face_groups = labels_.groups(left_out_);
    left_out_.tell(parsed.warnings);
    return parsed;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw InputError(name_ + ": " + what); }

  template <class List>
  const typename List::value_type& at(const List& list, int place, const char* what) const {
    if (place < 0 || static_cast<std::size_t>(place) >= list.size())
      fail(std::string("there is no ") + what + " " + std::to_string(place));
    return list[static_cast<std::size_t>(place)];
  }

  void load(std::string_view bytes) {
    tinygltf::TinyGLTF reader;
    reader.SetImageLoader([](tinygltf::Image*, const int, std::string*, std::string*, int, int, const unsigned char*,
                             int, void*) { return true; },
                          nullptr);  // pictures do not matter
    reader.SetFsCallbacks({file_exists, tinygltf::ExpandFilePath, read_whole_file, tinygltf::WriteWholeFile, nullptr});
    std::string errors, warnings;
    const std::string folder = std::filesystem::path(name_).parent_path().string();
    const auto size = static_cast<unsigned>(bytes.size());
    const bool is_binary = bytes.starts_with("glTF");
    require_shallow_json(name_, is_binary ? json_of_binary(bytes) : bytes);
    const bool read =
        is_binary ? reader.LoadBinaryFromMemory(&model_, &errors, &warnings,
                                                reinterpret_cast<const unsigned char*>(bytes.data()), size, folder)
                  : reader.LoadASCIIFromString(&model_, &errors, &warnings, bytes.data(), size, folder);
    constexpr std::string_view kBinaryOfVersion1("glTF\1\0\0\0", 8);
    if (bytes.starts_with(kBinaryOfVersion1) || model_.asset.version.starts_with("1."))
      fail("glTF 1.0 is not read; convert it to glTF 2.0");
    require_known_extensions();
    num_bytes_ = bytes.size();
    for (const tinygltf::Buffer& buffer : model_.buffers) num_bytes_ += buffer.data.size();
    if (read) return;
    std::replace(errors.begin(), errors.end(), '\n', ' ');
    fail("no glTF 2.0 file that can be read: " + errors.substr(0, errors.find_last_not_of(' ') + 1));
  }

  /// Refuses a file that requires an extension, unless the extension does not concern the shape.
  void require_known_extensions() const {
    constexpr std::string_view kAppearance[] = {"_materials_", "_texture_", "_technique", "_lights_", "_xmp"};
    for (const std::string& extension : model_.extensionsRequired) {
      const bool is_appearance =
          std::any_of(std::begin(kAppearance), std::end(kAppearance),
                      [&](std::string_view part) { return extension.find(part) != std::string::npos; });
      if (is_appearance || extension == "KHR_mesh_quantization") continue;
      fail("requires the extension " + in_quotes(extension) + ", which is not read" +
           (extension.ends_with("_compression") ? "; save the file without compression" : ""));
    }
  }

  static Transform transform_of(const tinygltf::Node& node) {
    Transform transform = Transform::Identity();
    if (node.matrix.size() == 16) {
      transform.matrix() = Eigen::Map<const Eigen::Matrix4d>(node.matrix.data());
      return transform;
    }
    if (node.translation.size() == 3) transform.translate(Vec3(node.translation.data()));
    if (node.rotation.size() == 4)
      transform.rotate(
          Eigen::Quaterniond(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]).normalized());
    if (node.scale.size() == 3) transform.scale(Vec3(node.scale.data()));
    return transform;
  }

  void add_node(int place, const Transform& above, int depth) {
    constexpr int kMostGltfNodeDepth = 64;
    const tinygltf::Node& node = at(model_.nodes, place, "node");
    if (depth > kMostGltfNodeDepth || ++num_nodes_ > model_.nodes.size()) fail("nodes are children of themselves");
    const Transform transform = above * transform_of(node);
    if (!transform.matrix().allFinite()) fail("node " + std::to_string(place) + ": a transform that is not finite");
    if (node.mesh >= 0) {
      const tinygltf::Mesh& mesh = at(model_.meshes, node.mesh, "mesh");
      used_meshes_.insert(node.mesh);
      const std::vector<double>& weights = node.weights.empty() ? mesh.weights : node.weights;
      count_read(weights.size());
      left_out_.add("skins", node.skin >= 0);
      left_out_.add("weights of morph targets",
                    weights.size() - static_cast<std::size_t>(std::count(weights.begin(), weights.end(), 0.0)));
      left_out_.add("lists of instances", node.extensions.contains("EXT_mesh_gpu_instancing"));
      add_mesh(mesh, node, transform);
    }
    for (const int child : node.children) add_node(child, transform, depth + 1);
  }

  void add_mesh(const tinygltf::Mesh& mesh, const tinygltf::Node& node, const Transform& transform) {
    for (const tinygltf::Primitive& primitive : mesh.primitives) {
      count_read(1 + primitive.attributes.size());
      const int mode = primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
      if (mode != TINYGLTF_MODE_TRIANGLES && mode != TINYGLTF_MODE_TRIANGLE_STRIP &&
          mode != TINYGLTF_MODE_TRIANGLE_FAN) {  // points and lines, such as wireframes
        ++num_lines_;
        continue;
      }
      const auto position = primitive.attributes.find("POSITION");
      if (position == primitive.attributes.end()) fail("a primitive without POSITION");
      const std::vector<double>& x = positions_of(position->second);
      for (const auto& [attribute, place] : primitive.attributes)
        if (const char* missed = what_is_missed(attribute))
          left_out_.add(missed, at(model_.accessors, place, "accessor").count);
      std::vector<std::size_t> corners;
      if (primitive.indices >= 0) {
        for (const double v : numbers(primitive.indices, 1, "indices")) {
          if (!(v >= 0 && v < static_cast<double>(x.size() / 3))) fail("indices: a vertex that does not exist");
          corners.push_back(static_cast<std::size_t>(v));
        }
      } else {
        for (std::size_t v = 0; v < x.size() / 3; ++v) corners.push_back(v);
      }
      count_read(corners.size());
      const std::string material =
          primitive.material < 0 ? std::string() : at(model_.materials, primitive.material, "material").name;
      add_triangles(x, corners, mode, transform, material, node.name.empty() ? mesh.name : node.name);
    }
  }

  /// The coordinates of an accessor. Many programs put all vertices into one, which every primitive names.
  const std::vector<double>& positions_of(int accessor) {
    if (accessor != last_accessor_) {
      last_positions_ = numbers(accessor, 3, "POSITION");
      last_accessor_ = accessor;
      count_read(last_positions_.size() / 3);
    }
    return last_positions_;
  }

  /// Counts vertices, corners and the like that are read. Each takes at least a byte of the file or its buffers; beyond
  /// these, it is read again.
  void count_read(std::size_t n) {
    constexpr std::size_t kMostRepeatedMeshItems = 1 << 25;
    num_read_ += n;
    if (num_read_ > num_bytes_ + kMostRepeatedMeshItems)
      fail("nodes repeat meshes of more than 33 million vertices and corners in all");
  }

  /// Returns what an attribute of vertices is, for warnings; null for positions, normals and the parts of skins.
  static const char* what_is_missed(const std::string& attribute) {
    if (attribute.starts_with("TEXCOORD_")) return "texture coordinates";
    if (attribute.starts_with("COLOR_")) return "colors of vertices";
    return attribute.starts_with("_") ? "attributes of vertices" : nullptr;
  }

  void add_triangles(const std::vector<double>& x, const std::vector<std::size_t>& corners, int mode,
                     const Transform& transform, const std::string& material, const std::string& object) {
    const bool mirrors = transform.linear().determinant() < 0;
    const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
      if (mirrors) std::swap(b, c);
      for (const std::size_t v : {a, b, c}) {
        const Vec3 p = transform * Vec3(&x[3 * v]);
        if (!p.allFinite()) fail("POSITION: a coordinate that is not finite");
        welder_.add(p);
      }
      labels_.add(material, object);
    };
    if (mode == TINYGLTF_MODE_TRIANGLES) {
      if (corners.size() % 3 != 0)
        fail("expected three vertices for each triangle, found " + std::to_string(corners.size()) + " in a primitive");
      for (std::size_t k = 0; k + 2 < corners.size(); k += 3) add(corners[k], corners[k + 1], corners[k + 2]);
      return;
    }
    for (std::size_t k = 2; k < corners.size(); ++k) {
      if (mode == TINYGLTF_MODE_TRIANGLE_FAN)
        add(corners[0], corners[k - 1], corners[k]);
      else if (k % 2 == 0)
        add(corners[k - 2], corners[k - 1], corners[k]);
      else
        add(corners[k - 1], corners[k - 2], corners[k]);
    }
  }

  /// The numbers of an accessor, `components` for each entry; normalized ones from -1 or 0 to 1.
  std::vector<double> numbers(int place, int components, const char* what) const {
    const tinygltf::Accessor& accessor = at(model_.accessors, place, "accessor");
    if (tinygltf::GetNumComponentsInType(static_cast<uint32_t>(accessor.type)) != components)
      fail(std::string(what) + ": expected " + std::to_string(components) + " numbers for each entry");
    if (accessor.bufferView < 0) fail(std::string(what) + ": an accessor without data, which stands for zeros");
    std::vector<double> values = numbers_of(accessor, components, what);
    if (accessor.sparse.isSparse) replace_sparse(values, accessor, components, what);
    return values;
  }

  /// Replaces the entries that the sparse part of an accessor names.
  void replace_sparse(std::vector<double>& values, const tinygltf::Accessor& accessor, int components,
                      const char* what) const {
    tinygltf::Accessor places, entries = accessor;
    places.bufferView = accessor.sparse.indices.bufferView;
    places.byteOffset = static_cast<std::size_t>(accessor.sparse.indices.byteOffset);
    places.componentType = accessor.sparse.indices.componentType;
    places.type = TINYGLTF_TYPE_SCALAR;
    entries.bufferView = accessor.sparse.values.bufferView;
    entries.byteOffset = static_cast<std::size_t>(accessor.sparse.values.byteOffset);
    if (accessor.sparse.count < 0) fail(std::string(what) + ": a sparse accessor of negative length");
    places.count = entries.count = static_cast<std::size_t>(accessor.sparse.count);
    const std::vector<double> at_places = numbers_of(places, 1, what),
                              replacing = numbers_of(entries, components, what);
    const auto step = static_cast<std::size_t>(components);
    for (std::size_t i = 0; i < at_places.size(); ++i) {
      if (!(at_places[i] >= 0 && at_places[i] < static_cast<double>(accessor.count)))
        fail(std::string(what) + ": a sparse accessor replaces an entry that does not exist");
      std::copy_n(replacing.begin() + static_cast<std::ptrdiff_t>(i * step), step,
                  values.begin() + static_cast<std::ptrdiff_t>(at_places[i]) * components);
    }
  }

  /// The numbers of the dense part of an accessor.
  std::vector<double> numbers_of(const tinygltf::Accessor& accessor, int components, const char* what) const {
    const tinygltf::BufferView& view = at(model_.bufferViews, accessor.bufferView, "buffer view");
    const std::vector<unsigned char>& bytes = at(model_.buffers, view.buffer, "buffer").data;
    const int size = tinygltf::GetComponentSizeInBytes(static_cast<uint32_t>(accessor.componentType));
    const int stride = accessor.ByteStride(view);
    const std::size_t entry = static_cast<std::size_t>(std::max(size, 0) * components);
    if (size <= 0 || stride < static_cast<int>(entry)) fail(std::string(what) + ": unknown type of numbers");
    const std::size_t begin = view.byteOffset + accessor.byteOffset, step = static_cast<std::size_t>(stride);
    if (begin < view.byteOffset || begin > bytes.size() ||
        (accessor.count > 0 && ((accessor.count - 1) > (bytes.size() - begin) / step ||
                                (accessor.count - 1) * step + entry > bytes.size() - begin)))
      fail(std::string(what) + ": the data end beyond their buffer");
    std::vector<double> values;
    values.reserve(accessor.count * static_cast<std::size_t>(components));
    for (std::size_t i = 0; i < accessor.count; ++i)
      for (int k = 0; k < components; ++k)
        values.push_back(decode(bytes.data() + begin + i * step + static_cast<std::size_t>(k * size), accessor, what));
    return values;
  }

  template <class T>
  static double as_number(const unsigned char* bytes, bool normalized) {
    T value;
    std::memcpy(&value, bytes, sizeof value);
    if constexpr (std::is_integral_v<T>)
      if (normalized)
        return std::max(static_cast<double>(value) / static_cast<double>(std::numeric_limits<T>::max()), -1.0);
    return static_cast<double>(value);
  }

  double decode(const unsigned char* bytes, const tinygltf::Accessor& accessor, const char* what) const {
    switch (accessor.componentType) {
      case TINYGLTF_COMPONENT_TYPE_FLOAT: return as_number<float>(bytes, false);
      case TINYGLTF_COMPONENT_TYPE_DOUBLE: return as_number<double>(bytes, false);
      case TINYGLTF_COMPONENT_TYPE_BYTE: return as_number<std::int8_t>(bytes, accessor.normalized);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return as_number<std::uint8_t>(bytes, accessor.normalized);
      case TINYGLTF_COMPONENT_TYPE_SHORT: return as_number<std::int16_t>(bytes, accessor.normalized);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return as_number<std::uint16_t>(bytes, accessor.normalized);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT: return as_number<std::uint32_t>(bytes, false);
      default: fail(std::string(what) + ": unknown type of numbers");
    }
  }

  std::string name_;
  tinygltf::Model model_;
  TriangleWelder welder_;
  LeftOut left_out_;
  FaceLabels labels_;
  std::set<int> used_meshes_;
  std::size_t num_nodes_ = 0, num_lines_ = 0;
  std::size_t num_bytes_ = 0, num_read_ = 0;  ///< bytes of the file and its buffers; see count_read
  int last_accessor_ = -1;                    ///< of `positions_of`
  std::vector<double> last_positions_;
};

}  // namespace

ParsedSurface parse_gltf(const std::string& name, std::string_view bytes) { return GltfParser(name, bytes).parse(); }

}  // namespace subvol::internal
