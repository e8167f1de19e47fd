// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/color_groups.h"
#include "subvol/io/left_out.h"
#include "subvol/io/surface_formats.h"
#include "subvol/io/zip_archive.h"

#include <Eigen/Geometry>
#include <pugixml.hpp>

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>

namespace subvol::internal {

namespace {

using Transform = Eigen::Transform<double, 3, Eigen::Affine, Eigen::DontAlign>;

/// Returns the name of an element or attribute without the prefix of its namespace.
template <class Named>
std::string_view local_name(const Named& named) {
  const std::string_view name = named.name();
  return name.substr(name.find(':') + 1);
}

std::size_t num_children(const pugi::xml_node& node) {
  return static_cast<std::size_t>(std::distance(node.begin(), node.end()));
}

/// Path of a part without the slash that stands before it in references.
std::string part_path(std::string path) {
  if (path.starts_with("/")) path.erase(0, 1);
  return path;
}

/// A property that triangles refer to: a name for a base material, a color such as "#ff8000" for a color.
using Properties = std::vector<std::string>;

/// Returns the color of a text such as "#FF8000" or "#FF8000C0" (with its opacity); empty if it is none.
std::string color_of(const std::string& text) {
  const bool is_color = (text.size() == 7 || text.size() == 9) && text[0] == '#' &&
                        text.find_first_not_of("0123456789abcdefABCDEF", 1) == std::string::npos;
  return is_color ? lower_case(text.substr(0, 7)) : std::string();
}

/// A model part of the package, and its resources by their ids.
struct ModelPart {
  std::string path, text;
  pugi::xml_document document;
  std::map<std::string, pugi::xml_node> objects;
  std::map<std::string, Properties> materials, colors;
  std::map<std::string, const char*> other_properties;  ///< what they are, for warnings

  [[noreturn]] void fail(const std::string& file, const std::string& what) const {
    throw InputError(file + ": " + path + ": " + what);
  }
};

class ThreeMfParser {
 public:
  ThreeMfParser(const std::string& name, std::string_view bytes) : name_(name), archive_(name, bytes) {}

  ParsedSurface parse() {
    const ModelPart& root = part(model_path());
    const pugi::xml_node model = root.document.document_element();
    const std::string unit = model.attribute("unit").as_string("millimeter");
    if (unit != "millimeter") warnings_.push_back("the unit of length is the " + unit + "; lengths are not converted");
    std::size_t num_items = 0;
    for (const pugi::xml_node item : model.child("build").children("item")) {
      add_object(part_of(item, root), item.attribute("objectid").value(), transform_of(item), "", 0);
      ++num_items;
    }
    if (num_items == 0)  // some programs leave the list of what is to be built empty
      for (const auto& [id, object] : root.objects)
        if (object.child("mesh")) add_object(root, id, Transform::Identity(), "", 0);
    name_groups();
    if (num_sliced_ > 0)
      warnings_.push_back("slices are not read; the meshes of the objects that have them (" +
                          std::to_string(num_sliced_) + ") may be coarse stand-ins");
    ParsedSurface parsed{std::move(mesh_), std::move(warnings_)};
    left_out_.tell(parsed.warnings);
    return parsed;
  }

 private:
  void load(ModelPart& part, const std::string& path) const {
    part.path = path;
    part.text = archive_.read(path);
    const pugi::xml_parse_result result = part.document.load_buffer_inplace(part.text.data(), part.text.size());
    if (!result)
      part.fail(name_, "not whole XML at byte " + std::to_string(result.offset) + ": " + result.description());
    const auto roots = part.document.children();
    if (std::count_if(roots.begin(), roots.end(), [](const auto& n) { return n.type() == pugi::node_element; }) != 1)
      part.fail(name_, "not XML: expected one root element");
  }

  /// Returns the model part of a path, which is read when it is first asked for.
  const ModelPart& part(const std::string& path) {
    const auto [found, is_new] = parts_.try_emplace(path);
    ModelPart& part = found->second;
    if (!is_new) return part;
    load(part, path);
    num_bytes_ += part.text.size();
    const pugi::xml_node model = part.document.document_element();
    if (local_name(model) != "model")
      part.fail(name_, "expected the element model, found " + in_quotes(local_name(model)));
    for (const pugi::xml_node resource : model.child("resources").children()) {
      const std::string id = resource.attribute("id").value();
      const std::string_view kind = local_name(resource);
      if (kind == "object") {
        if (!part.objects.emplace(id, resource).second) part.fail(name_, "two objects have the id " + in_quotes(id));
      } else if (kind == "basematerials") {
        for (const pugi::xml_node base : resource.children("base"))
          part.materials[id].push_back(base.attribute("name").value());
      } else if (kind == "colorgroup") {
        for (const pugi::xml_node color : resource.children())
          part.colors[id].push_back(color_of(color.attribute("color").value()));
      } else if (kind == "texture2dgroup") {
        part.other_properties[id] = "faces with textures";
      } else if (kind == "compositematerials" || kind == "multiproperties") {
        part.other_properties[id] = "faces with several materials";
      }
    }
    return part;
  }

  /// Returns the part that holds the object of an item or component: another one if a path is there (production
  /// extension).
  const ModelPart& part_of(const pugi::xml_node& node, const ModelPart& own) {
    for (const pugi::xml_attribute attribute : node.attributes())
      if (local_name(attribute) == "path") return part(part_path(attribute.value()));
    return own;
  }

  /// The model that the relations of the package name, or the place where all programs put it.
  std::string model_path() {
    constexpr const char* kRelations = "_rels/.rels";
    constexpr std::string_view kModel = "/3dmodel";
    std::vector<std::string> targets;
    if (archive_.has(kRelations)) {
      ModelPart relations;
      load(relations, kRelations);
      for (const pugi::xml_node relation : relations.document.document_element().children()) {
        const std::string target = part_path(relation.attribute("Target").value());
        if (std::string_view(relation.attribute("Type").value()).ends_with(kModel) && archive_.has(target))
          targets.push_back(target);
      }
    }
    if (targets.size() > 1)
      warnings_.push_back(std::to_string(targets.size()) + " models in the package, of which only " + targets[0] +
                          " is read");
    if (!targets.empty()) return targets[0];
    for (const auto& [path, entry] : archive_.entries())
      if (lower_case(path).ends_with(".model")) return path;
    throw InputError(name_ + ": no 3MF file: there is no model in the archive");
  }

  double number(const ModelPart& part, const pugi::xml_node& node, const char* attribute) const {
    const auto value = parse_number(node.attribute(attribute).value());
    if (!value)
      part.fail(name_, std::string("expected a number ") + attribute + ", found " +
                           in_quotes(node.attribute(attribute).value()));
    return *value;
  }

  Transform transform_of(const pugi::xml_node& node) const {
    Transform transform = Transform::Identity();
    const std::string_view text = node.attribute("transform").value();
    if (text.empty()) return transform;
    TextScanner scan(name_, text);
    for (int row = 0; row < 4; ++row)  // of the transposed matrix
      for (int k = 0; k < 3; ++k) transform(k, row) = scan.number("twelve numbers of a transform");
    return transform;
  }

  /// Adds an object with its components. group: the name of the object that it is a part of, if that has one.
  void add_object(const ModelPart& part, const std::string& id, const Transform& transform, const std::string& group,
                  int depth) {
    constexpr int kMost3mfComponentDepth = 16;
    const auto found = part.objects.find(id);
    if (found == part.objects.end()) part.fail(name_, "there is no object " + in_quotes(id));
    if (depth > kMost3mfComponentDepth) part.fail(name_, "components include themselves");
    const pugi::xml_node object = found->second;
    count_visited(num_children(object), part);
    const std::string_view type = object.attribute("type").as_string("model");
    if (type == "support" || type == "solidsupport" || type == "other")
      return left_out_.add("objects of type " + std::string(type));
    const std::string own = object.attribute("name").value(), name = group.empty() ? own : group;
    for (const pugi::xml_node child : object.children()) {
      const std::string_view kind = child.name();
      if (kind == "mesh") {
        add_mesh(part, object, child, transform, name);
      } else if (kind == "components") {
        for (const pugi::xml_node component : child.children("component"))
          add_object(part_of(component, part), component.attribute("objectid").value(),
                     transform * transform_of(component), name, depth + 1);
      } else if (child.type() == pugi::node_element && kind != "metadatagroup") {
        left_out_.add("objects of the kind " + in_quotes(local_name(child)));
      }
    }
    for (const pugi::xml_attribute attribute : object.attributes())
      num_sliced_ += local_name(attribute) == "slicestackid";
  }

  /// Counts elements that are visited. Each takes some bytes of its part; beyond these, it is visited again.
  void count_visited(std::size_t elements, const ModelPart& part) {
    constexpr std::size_t kMostRepeatedMeshItems = 1 << 25;  // components of components could double with every level
    num_visited_ += elements;
    if (num_visited_ > num_bytes_ + kMostRepeatedMeshItems)
      part.fail(name_, "components repeat objects of more than 33 million vertices and triangles in all");
  }

  Index corner(const ModelPart& part, const pugi::xml_node& triangle, const char* attribute, std::size_t first,
               std::size_t count) const {
    const auto value = parse_integer(triangle.attribute(attribute).value());
    if (!value || *value < 0 || static_cast<std::uint64_t>(*value) >= count)
      part.fail(name_, std::string("expected the number of a vertex as ") + attribute + " of a triangle, found " +
                           in_quotes(triangle.attribute(attribute).value()));
    return static_cast<Index>(first + static_cast<std::size_t>(*value));
  }

  void add_mesh(const ModelPart& part, const pugi::xml_node& object, const pugi::xml_node& mesh,
                const Transform& transform, const std::string& name) {
    ++num_meshes_;
    for (const pugi::xml_node child : mesh.children()) count_visited(1 + num_children(child), part);
    const std::size_t first = mesh_.positions.size();
    for (const pugi::xml_node vertex : mesh.child("vertices").children("vertex"))
      mesh_.positions.push_back(transform *
                                Vec3(number(part, vertex, "x"), number(part, vertex, "y"), number(part, vertex, "z")));
    const std::size_t count = mesh_.positions.size() - first;
    if (mesh_.positions.size() > static_cast<std::size_t>(std::numeric_limits<Index>::max()))
      part.fail(name_, "more vertices than an index can tell");
    const bool mirrors = transform.linear().determinant() < 0;
    const pugi::xml_node triangles = mesh.child("triangles");
    const int place = triangles.child("triangle") ? place_of(name) : -1;
    for (const pugi::xml_node triangle : triangles.children("triangle")) {
      const Index a = corner(part, triangle, "v1", first, count), b = corner(part, triangle, "v2", first, count),
                  c = corner(part, triangle, "v3", first, count);
      mesh_.face_vertices.insert(mesh_.face_vertices.end(), {a, mirrors ? c : b, mirrors ? b : c});
      mesh_.face_offsets.push_back(mesh_.face_vertices.size());
      add_property(part, object, triangle);
      names_of_face_.push_back(place);
    }
    for (const pugi::xml_node child : mesh.children()) {
      if (local_name(child) == "trianglesets") left_out_.add("sets of triangles", num_children(child));
      if (local_name(child) != "beamlattice") continue;
      for (const pugi::xml_node list : child.children()) {
        count_visited(num_children(list), part);
        if (const std::string_view kind = local_name(list); kind == "beams" || kind == "balls")
          left_out_.add(kind, num_children(list));
      }
    }
  }

  /// Place of a name in the list of all names of objects; -1 for no name.
  int place_of(const std::string& name) {
    if (name.empty()) return -1;
    return object_names_.try_emplace(name, static_cast<int>(object_names_.size())).first->second;
  }

  /// Notes the material or color of a triangle. A color that differs between the corners is none of the triangle.
  void add_property(const ModelPart& part, const pugi::xml_node& object, const pugi::xml_node& triangle) {
    const std::string pid = triangle.attribute("pid").as_string(object.attribute("pid").value());
    const std::string_view p1 = triangle.attribute("p1").as_string(object.attribute("pindex").value());
    const auto has = [](const auto& resources, const std::string& id) { return resources.find(id) != resources.end(); };
    const std::string* color = has(part.colors, pid) ? property(part.colors.at(pid), p1) : nullptr;
    for (const char* attribute : {"p2", "p3"})
      if (color && triangle.attribute(attribute).as_string(p1.data()) != p1) {
        color = nullptr;
        left_out_.add("faces with a color at each corner");
        break;
      }
    colors_of_face_.add_face(color ? *color : std::string());
    materials_of_face_.push_back(has(part.materials, pid) ? property(part.materials.at(pid), p1) : nullptr);
    const auto other = part.other_properties.find(pid);
    if (other != part.other_properties.end()) left_out_.add(other->second);
  }

  /// Returns the property of an index; null if there is none, or an empty one.
  static const std::string* property(const Properties& properties, std::string_view index) {
    const auto place = parse_integer(index);
    if (!place || *place < 0 || static_cast<std::size_t>(*place) >= properties.size()) return nullptr;
    const std::string& found = properties[static_cast<std::size_t>(*place)];
    return found.empty() ? nullptr : &found;
  }

  /// Materials that tell faces apart are groups; else colors are; else objects, if there are several.
  void name_groups() {
    const auto has_several = [](const auto& list) {
      return std::any_of(list.begin(), list.end(), [&](const auto& entry) { return entry != list.front(); });
    };
    const bool are_named = num_meshes_ > 1 && has_several(names_of_face_);
    if (has_several(materials_of_face_)) {
      GroupList groups;
      for (const std::string* name : materials_of_face_)
        mesh_.face_groups.of_face.push_back(name ? groups.by_name(*name) : kNoIndex);
      mesh_.face_groups.groups = groups.take();
      left_out_.add("colors of faces", colors_of_face_.num_colored());
    } else {
      mesh_.face_groups = colors_of_face_.take(left_out_, "colors of faces");
    }
    if (!are_named) return;
    if (!mesh_.face_groups.empty()) return left_out_.add("names of objects", object_names_.size());
    GroupList groups;
    std::vector<std::string> names(object_names_.size());
    for (const auto& [name, place] : object_names_) names[static_cast<std::size_t>(place)] = name;
    for (const int place : names_of_face_)
      mesh_.face_groups.of_face.push_back(place < 0 ? kNoIndex
                                                    : groups.by_name(names[static_cast<std::size_t>(place)]));
    mesh_.face_groups.groups = groups.take();
  }

  std::string name_;
  ZipArchive archive_;
  std::map<std::string, ModelPart> parts_;
  std::vector<const std::string*> materials_of_face_;  ///< names of materials, or null
  ColorGroups colors_of_face_;
  std::map<std::string, int> object_names_;
  std::vector<int> names_of_face_;
  PolygonMesh mesh_;
  LeftOut left_out_;
  std::vector<std::string> warnings_;
  std::size_t num_meshes_ = 0, num_sliced_ = 0;
  std::size_t num_bytes_ = 0, num_visited_ = 0;  ///< bytes of the parts that were read; see count_visited
};

}  // namespace

ParsedSurface parse_3mf(const std::string& name, std::string_view bytes) { return ThreeMfParser(name, bytes).parse(); }

}  // namespace subvol::internal
