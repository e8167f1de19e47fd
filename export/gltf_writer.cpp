// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/gltf_writer.h"

#include "subvol/base/atomic_file.h"
#include "subvol/base/error.h"
#include "subvol/base/version.h"
#include "subvol/export/text_format.h"

#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <sstream>

namespace subvol {

using namespace internal;
namespace {

namespace gltf = tinygltf;

constexpr double kUnitNormalTolerance = 1e-6;

/// Reports a problem in one array of one node, starting with the node's name.
struct Complaint {
  std::string node;
  [[noreturn]] void operator()(const std::string& array, const std::string& problem) const {
    throw InputError("scene node \"" + node + "\": " + array + ": " + problem);
  }
};

float to_float(double value, const std::string& array, const Complaint& refuse) {
  const float single = static_cast<float>(value);
  if (!std::isfinite(single)) refuse(array, "expected finite numbers in the range of float32");
  return single;
}

bool is_attribute_name(const std::string& name) {
  return name.size() > 1 && name[0] == '_' && std::all_of(name.begin() + 1, name.end(), [](unsigned char c) {
           return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
         });
}

/// Coordinate system of a file: position = origin + unit * coordinate.
struct Placement {
  Vec3 origin;
  double unit = 1;
  bool quantize = false;  ///< coordinates are within -1 .. 1, and are written as small integers
};

/// Appends typed arrays to one buffer, each with its own bufferView and accessor.
class BufferWriter {
 public:
  explicit BufferWriter(gltf::Model& model) : model_(model) { model_.buffers.emplace_back(); }

  /// Adds values with `width` components per element; returns the accessor's number.
  template <class T>
  int add(const std::vector<T>& values, int width, int component_type, int target, const std::string& name,
          bool with_bounds = false, bool normalized = false) {
    gltf::Accessor accessor;
    accessor.name = name;
    accessor.bufferView = add_view(values.data(), values.size() * sizeof(T), target);
    accessor.componentType = component_type;
    accessor.count = values.size() / width;
    accessor.type = width == 1 ? TINYGLTF_TYPE_SCALAR : width == 3 ? TINYGLTF_TYPE_VEC3 : TINYGLTF_TYPE_VEC4;
    accessor.normalized = normalized;
    if (with_bounds) set_bounds(accessor, values, width);
    model_.accessors.push_back(std::move(accessor));
    return static_cast<int>(model_.accessors.size()) - 1;
  }

  /// Adds triples of numbers in [-1, 1] as integers of a type, each triple padded to four.
  template <class Int>
  int add_quantized(const std::vector<float>& values, int component_type, const std::string& name, bool with_bounds) {
    std::vector<Int> whole, padded;
    for (std::size_t i = 0; i < values.size(); ++i) {
      whole.push_back(static_cast<Int>(std::lround(values[i] * std::numeric_limits<Int>::max())));
      padded.push_back(whole.back());
      if (i % 3 == 2) padded.push_back(0);
    }
    const int number = add(padded, 4, component_type, TINYGLTF_TARGET_ARRAY_BUFFER, name, false, true);
    gltf::Accessor& accessor = model_.accessors.back();
    accessor.type = TINYGLTF_TYPE_VEC3;
    if (with_bounds) set_bounds(accessor, whole, 3);
    model_.bufferViews[accessor.bufferView].byteStride = 4 * sizeof(Int);
    return number;
  }

 private:
  int add_view(const void* bytes, std::size_t size, int target) {
    auto& data = model_.buffers[0].data;
    gltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = data.size();
    view.byteLength = size;
    view.target = target;
    constexpr std::size_t kLimit = std::numeric_limits<std::int32_t>::max();
    if (size > kLimit - 4 || data.size() > kLimit - 4 - size) throw InputError("scene: expected less than 2^31 bytes");
    const auto* first = static_cast<const unsigned char*>(bytes);
    data.insert(data.end(), first, first + size);
    data.resize((data.size() + 3) / 4 * 4);
    model_.bufferViews.push_back(std::move(view));
    return static_cast<int>(model_.bufferViews.size()) - 1;
  }

  template <class T>
  static void set_bounds(gltf::Accessor& accessor, const std::vector<T>& values, int width) {
    accessor.minValues.assign(values.begin(), values.begin() + width);
    accessor.maxValues = accessor.minValues;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double value = values[i];
      accessor.minValues[i % width] = std::min(accessor.minValues[i % width], value);
      accessor.maxValues[i % width] = std::max(accessor.maxValues[i % width], value);
    }
  }

  gltf::Model& model_;
};

std::vector<float> relative_positions(const std::vector<Vec3>& positions, const Placement& place,
                                      const Complaint& refuse) {
  constexpr double kLeastFloat32Size = 1e-30;  // below it, single precision runs out of digits
  std::vector<float> values;
  values.reserve(3 * positions.size());
  double largest = 0;
  for (const Vec3& position : positions)
    for (const double x : Vec3(position - place.origin)) {
      const float plain = to_float(x, "positions", refuse);  // readers put quantized ones back to this size
      values.push_back(place.unit == 1 ? plain : static_cast<float>(x / place.unit));
      largest = std::max(largest, std::abs(x));
    }
  if (largest > 0 && largest < kLeastFloat32Size) refuse("positions", "expected a size in the range of float32");
  return values;
}

std::vector<float> unit_normals(const std::vector<Vec3>& normals, const Complaint& refuse) {
  std::vector<float> values;
  values.reserve(3 * normals.size());
  for (const Vec3& normal : normals) {
    if (!(std::abs(normal.norm() - 1) <= kUnitNormalTolerance)) refuse("normals", "expected length 1");
    for (const double x : normal) values.push_back(static_cast<float>(x));
  }
  return values;
}

std::vector<std::uint16_t> color_words(const ScenePrimitive& primitive, const Complaint& refuse) {
  std::vector<std::uint16_t> values;
  values.reserve(4 * primitive.colors.size());
  for (const LinearColor& color : primitive.colors)
    for (const double c : color) {
      if (!(c >= 0 && c <= 1)) refuse("colors", "expected values in [0, 1]");
      values.push_back(static_cast<std::uint16_t>(std::lround(c * 65535)));
    }
  return values;
}

void check_sizes(const ScenePrimitive& primitive, const Complaint& refuse) {
  const std::size_t n = primitive.positions.size();
  const auto check = [&](std::size_t size, const std::string& array, bool may_be_empty) {
    if (size == n || (may_be_empty && size == 0)) return;
    refuse(array, "expected " + std::to_string(n) + " entries, one per position, got " + std::to_string(size));
  };
  if (n == 0) refuse("positions", "expected at least one");
  check(primitive.normals.size(), "normals", true);
  check(primitive.colors.size(), "colors", true);
  for (const SceneAttribute& attribute : primitive.attributes) {
    if (!is_attribute_name(attribute.name))
      refuse("attribute \"" + attribute.name + "\"", "expected a name of an underscore and capitals");
    check(attribute.values.size(), attribute.name, false);
  }
  const std::size_t corners = primitive.topology == ScenePrimitive::Topology::triangles ? 3 : 2;
  if (primitive.indices.empty() || primitive.indices.size() % corners != 0)
    refuse("indices", "expected a positive multiple of " + std::to_string(corners));
  for (const Index i : primitive.indices)
    if (i < 0 || static_cast<std::size_t>(i) >= n)
      refuse("indices", "expected numbers from 0 to " + std::to_string(n - 1) + ", got " + std::to_string(i));
}

int add_indices(BufferWriter& buffer, const ScenePrimitive& primitive, std::span<const Index> indices) {
  // The index 65535 restarts a primitive in some graphics interfaces, so glTF forbids it.
  constexpr std::size_t kMaxShortVertices = 65535;
  constexpr int kIndexBufferTarget = TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER;
  if (primitive.positions.size() <= kMaxShortVertices)
    return buffer.add(std::vector<std::uint16_t>(indices.begin(), indices.end()), 1,
                      TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, kIndexBufferTarget, "indices");
  return buffer.add(std::vector<std::uint32_t>(indices.begin(), indices.end()), 1, TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT,
                    kIndexBufferTarget, "indices");
}

int add_material(gltf::Model& model, const SceneNode& node, const std::string& name, const Complaint& refuse) {
  gltf::Material material;
  material.name = name;
  material.doubleSided = true;
  material.pbrMetallicRoughness.metallicFactor = 0;
  material.pbrMetallicRoughness.roughnessFactor = 0.7;
  for (const double c : node.primitive.material_color)
    if (!(c >= 0 && c <= 1)) refuse("material_color", "expected values in [0, 1]");
  material.pbrMetallicRoughness.baseColorFactor.assign(node.primitive.material_color.begin(),
                                                       node.primitive.material_color.end());
  model.materials.push_back(std::move(material));
  return static_cast<int>(model.materials.size()) - 1;
}

/// Returns to - from, number by number.
std::vector<float> differences(std::vector<float> to, const std::vector<float>& from) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] -= from[i];
  return to;
}

/// Adds the shapes of a node as morph targets of its primitive.
void add_shapes(gltf::Mesh& mesh, BufferWriter& buffer, const SceneNode& node, const Placement& place,
                const Complaint& refuse) {
  constexpr int kVertexBufferTarget = TINYGLTF_TARGET_ARRAY_BUFFER, kFloat = TINYGLTF_COMPONENT_TYPE_FLOAT;
  const ScenePrimitive& rest = node.primitive;
  if (rest.topology != ScenePrimitive::Topology::triangles) refuse("shapes", "expected none of lines");
  const std::vector<float> positions = relative_positions(rest.positions, place, refuse);
  const std::vector<float> normals = unit_normals(rest.normals, refuse);
  gltf::Value::Array names;
  for (const SceneShape& shape : node.shapes) {
    if (shape.positions.size() != rest.positions.size() || shape.normals.size() != rest.normals.size())
      refuse("shape \"" + shape.name + "\"", "expected as many positions and normals as the primitive has");
    std::map<std::string, int> target;
    target["POSITION"] = buffer.add(differences(relative_positions(shape.positions, place, refuse), positions), 3,
                                    kFloat, kVertexBufferTarget, shape.name + " positions", true);
    if (!normals.empty())
      target["NORMAL"] = buffer.add(differences(unit_normals(shape.normals, refuse), normals), 3, kFloat,
                                    kVertexBufferTarget, shape.name + " normals");
    mesh.primitives[0].targets.push_back(std::move(target));
    names.emplace_back(shape.name);
  }
  mesh.weights.assign(node.shapes.size(), 0);
  mesh.extras = gltf::Value(gltf::Value::Object{{"targetNames", gltf::Value(std::move(names))}});
}

/// Adds a copy of a primitive, without indices, for each part.
void add_parts(gltf::Model& model, BufferWriter& buffer, const SceneNode& node, const gltf::Primitive& primitive,
               const Complaint& refuse, gltf::Mesh& mesh) {
  const ScenePrimitive& source = node.primitive;
  std::size_t next = 0;
  for (const ScenePart& part : source.parts) {
    if (part.first != next || part.size == 0 || part.size % 3 != 0 || part.size > source.indices.size() - next)
      refuse("parts", "expected triangles, one part after another");
    next += part.size;
    gltf::Primitive one = primitive;
    one.indices = add_indices(buffer, source, std::span(source.indices).subspan(part.first, part.size));
    one.material = add_material(model, node, part.name, refuse);
    if (part.number != 0)
      model.materials.back().extras = gltf::Value(gltf::Value::Object{{"number", gltf::Value(part.number)}});
    mesh.primitives.push_back(std::move(one));
  }
  if (next != source.indices.size()) refuse("parts", "expected all triangles to be in one");
}

/// Adds mesh, material and node; returns the node's number.
int add_node(gltf::Model& model, BufferWriter& buffer, const SceneNode& node, const Placement& place) {
  const Complaint refuse{node.name};
  const ScenePrimitive& source = node.primitive;
  check_sizes(source, refuse);
  constexpr int kVertexBufferTarget = TINYGLTF_TARGET_ARRAY_BUFFER, kFloat = TINYGLTF_COMPONENT_TYPE_FLOAT;
  gltf::Primitive primitive;
  const std::vector<float> positions = relative_positions(source.positions, place, refuse);
  primitive.attributes["POSITION"] =
      place.quantize ? buffer.add_quantized<std::int16_t>(positions, TINYGLTF_COMPONENT_TYPE_SHORT, "positions", true)
                     : buffer.add(positions, 3, kFloat, kVertexBufferTarget, "positions", true);
  if (!source.normals.empty()) {
    const std::vector<float> normals = unit_normals(source.normals, refuse);
    primitive.attributes["NORMAL"] =
        place.quantize ? buffer.add_quantized<std::int8_t>(normals, TINYGLTF_COMPONENT_TYPE_BYTE, "normals", false)
                       : buffer.add(normals, 3, kFloat, kVertexBufferTarget, "normals");
  }
  if (!source.colors.empty())
    primitive.attributes["COLOR_0"] = buffer.add(color_words(source, refuse), 4, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT,
                                                 kVertexBufferTarget, "colors", false, true);
  for (const SceneAttribute& attribute : source.attributes) {
    std::vector<float> values;
    for (const double x : attribute.values) values.push_back(to_float(x, attribute.name, refuse));
    primitive.attributes[attribute.name] = buffer.add(values, 1, kFloat, kVertexBufferTarget, attribute.name, true);
  }
  primitive.mode =
      source.topology == ScenePrimitive::Topology::triangles ? TINYGLTF_MODE_TRIANGLES : TINYGLTF_MODE_LINE;
  gltf::Mesh mesh;
  mesh.name = node.name;
  if (source.parts.empty() || !node.shapes.empty()) {
    primitive.indices = add_indices(buffer, source, source.indices);
    primitive.material = add_material(model, node, node.name, refuse);
    mesh.primitives.push_back(std::move(primitive));
  } else {
    add_parts(model, buffer, node, primitive, refuse, mesh);
  }
  if (!node.shapes.empty()) add_shapes(mesh, buffer, node, place, refuse);
  model.meshes.push_back(std::move(mesh));
  gltf::Node out;
  out.name = node.name;
  out.mesh = static_cast<int>(model.meshes.size()) - 1;
  if (place.quantize) out.scale = {place.unit, place.unit, place.unit};
  model.nodes.push_back(std::move(out));
  return static_cast<int>(model.nodes.size()) - 1;
}

/// Plays the shapes of a node one after another, then the primitive itself: weight k is 1 at time k.
void add_animation(gltf::Model& model, BufferWriter& buffer, int node, std::size_t num_shapes,
                   double seconds_per_shape) {
  std::vector<float> times, weights;
  for (std::size_t step = 0; step <= num_shapes; ++step) {
    const auto time = static_cast<float>(static_cast<double>(step) * seconds_per_shape);
    if (!std::isfinite(time) || (step > 0 && !(time > times.back())))
      throw InputError("scene: seconds_per_shape: expected times of the shapes that differ, in the range of float32");
    times.push_back(time);
    for (std::size_t shape = 0; shape < num_shapes; ++shape) weights.push_back(step == shape ? 1.0F : 0.0F);
  }
  constexpr int kNoTarget = 0, kFloat = TINYGLTF_COMPONENT_TYPE_FLOAT;
  gltf::AnimationSampler sampler;
  sampler.input = buffer.add(times, 1, kFloat, kNoTarget, "times", true);
  sampler.output = buffer.add(weights, 1, kFloat, kNoTarget, "weights");
  sampler.interpolation = "LINEAR";
  gltf::AnimationChannel channel;
  channel.sampler = 0;
  channel.target_node = node;
  channel.target_path = "weights";
  gltf::Animation animation;
  animation.name = "shapes";
  animation.samplers.push_back(std::move(sampler));
  animation.channels.push_back(std::move(channel));
  model.animations.push_back(std::move(animation));
}

gltf::Value to_value(const std::string& key, const SceneValue& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return gltf::Value(*flag);
  if (const auto* text = std::get_if<std::string>(&value)) return gltf::Value(*text);
  const double number = std::get<double>(value);
  if (!std::isfinite(number)) throw InputError("scene extras: " + key + ": expected a finite number");
  constexpr double kMaxInt = std::numeric_limits<int>::max();
  if (number == std::floor(number) && std::abs(number) <= kMaxInt) return gltf::Value(static_cast<int>(number));
  return gltf::Value(number);
}

gltf::Value to_object(const SceneValues& values) {
  gltf::Value::Object object;
  for (const auto& [key, value] : values) object[key] = to_value(key, value);
  return gltf::Value(object);
}

gltf::Value extras(const Scene& scene) {
  auto object = to_object(scene.extras).Get<gltf::Value::Object>();
  object["unit"] = gltf::Value(std::string("meter"));
  object["meters_per_input_unit"] = gltf::Value(scene.meters_per_unit);
  object["up_axis"] = gltf::Value(std::string(scene.up_axis == UpAxis::y ? "y" : "z"));
  object["version"] = gltf::Value(std::string(version()));
  object["options"] = to_object(scene.options);
  return gltf::Value(object);
}

gltf::Node root_node(const Scene& scene, std::vector<int> children) {
  gltf::Node root;
  root.name = scene.name;
  root.children = std::move(children);
  const double s = scene.meters_per_unit;
  Vec3 translation = s * scene.origin;
  if (scene.up_axis == UpAxis::z) {
    root.rotation = {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
    translation = Vec3(translation.x(), translation.z(), -translation.y());
  }
  root.translation = {translation.x(), translation.y(), translation.z()};
  root.scale = {s, s, s};
  root.extras = extras(scene);
  return root;
}

Placement placement(const Scene& scene) {
  Placement place{scene.origin};
  if (!scene.quantize) return place;
  double extent = 0;
  for (const SceneNode& node : scene.nodes)
    for (const Vec3& p : node.primitive.positions) extent = std::max(extent, (p - scene.origin).cwiseAbs().maxCoeff());
  // Positions that are not finite are refused by name when they are written.
  place.quantize = extent > 0 && std::isfinite(extent);
  if (place.quantize) place.unit = extent;
  return place;
}

gltf::Model model_of(const Scene& scene) {
  if (scene.nodes.empty()) throw InputError("scene: expected at least one node");
  if (!(scene.meters_per_unit > 0) || !std::isfinite(scene.meters_per_unit))
    throw InputError("scene: meters_per_unit: expected a positive number");
  if (!(scene.meters_per_unit * scene.origin).cast<float>().allFinite())
    throw InputError("scene: origin: expected finite numbers in the range of float32");
  if (!(scene.seconds_per_shape > 0) || !std::isfinite(scene.seconds_per_shape))
    throw InputError("scene: seconds_per_shape: expected a positive number");
  gltf::Model model;
  model.asset.version = "2.0";
  model.asset.generator = std::string("subvol ") + version();
  model.asset.extras = extras(scene);
  model.nodes.emplace_back();
  const Placement place = placement(scene);
  if (place.quantize) model.extensionsUsed = model.extensionsRequired = {"KHR_mesh_quantization"};
  BufferWriter buffer(model);
  std::vector<int> children;
  for (const SceneNode& node : scene.nodes) {
    children.push_back(add_node(model, buffer, node, place));
    if (!node.shapes.empty())
      add_animation(model, buffer, children.back(), node.shapes.size(), scene.seconds_per_shape);
  }
  model.nodes[0] = root_node(scene, std::move(children));
  gltf::Scene root;
  root.name = scene.name;
  root.nodes = {0};
  model.scenes.push_back(std::move(root));
  model.defaultScene = 0;
  return model;
}

}  // namespace

std::string gltf_bytes(const Scene& scene, GltfContainer container) {
  const gltf::Model model = model_of(scene);
  std::ostringstream stream;
  bool done = false;
  try {
    done = gltf::TinyGLTF().WriteGltfSceneToStream(&model, stream, true, container == GltfContainer::glb);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception&) {
    // All numbers have been checked; the only thing that the JSON writer still refuses is text that is not UTF-8.
    throw InputError("scene: names and extras: expected UTF-8 text");
  }
  if (!done || !stream) throw IoError("glTF: the writer failed");
  return std::move(stream).str();
}

void write_gltf(const std::filesystem::path& path, const Scene& scene) {
  const std::string extension = lower_case_extension(path);
  if (extension != ".glb" && extension != ".gltf")
    throw InputError(path.string() + ": expected the extension .glb or .gltf");
  write_file_atomically(path, gltf_bytes(scene, extension == ".glb" ? GltfContainer::glb : GltfContainer::gltf));
}

}  // namespace subvol
