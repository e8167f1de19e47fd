// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/left_out.h"
#include "subvol/io/surface_formats.h"
#include "subvol/io/zip_archive.h"

#include <Eigen/Geometry>
#include <pugixml.hpp>

#include <algorithm>
#include <map>
#include <optional>

namespace subvol::internal {

namespace {

using Transform = Eigen::Transform<double, 3, Eigen::Affine, Eigen::DontAlign>;

std::string_view local_name(const pugi::xml_node& node) {
  const std::string_view name = node.name();
  return name.substr(name.find(':') + 1);
}

class ThreeMfParser {
 public:
  ThreeMfParser(const std::string& name, std::string_view bytes) : name_(name), archive_(name, bytes) {}

  ParsedSurface parse() {
    load(model_path());
    const pugi::xml_node model = document_.document_element();
    if (local_name(model) != "model") fail("expected the element model, found " + in_quotes(local_name(model)));
    for (const pugi::xml_node resource : model.child("resources").children()) {
      const std::string id = resource.attribute("id").value();
      if (local_name(resource) == "object") objects_[id] = resource;
      else if (local_name(resource) == "basematerials") read_materials(id, resource);
    }
    std::size_t num_items = 0;
    for (const pugi::xml_node item : model.child("build").children("item")) {
      add_object(item.attribute("objectid").value(), transform_of(item), "", 0);
      ++num_items;
    }
    if (num_items == 0)  // some programs leave the list of what is to be built empty
      for (const auto& [id, object] : objects_)
        if (object.child("mesh")) add_object(id, Transform::Identity(), "", 0);
    name_groups();
    ParsedSurface parsed{std::move(mesh_), {}};
    left_out_.tell(parsed.warnings);
    return parsed;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw InputError(name_ + ": " + path_ + ": " + what); }

  void load(const std::string& path) {
    path_ = path;
    text_ = archive_.read(path);
    const pugi::xml_parse_result result = document_.load_buffer_inplace(text_.data(), text_.size());
    if (!result) fail("not whole XML at byte " + std::to_string(result.offset) + ": " + result.description());
  }

  /// The model that the relations of the package name, or the place where all programs put it.
  std::string model_path() {
    constexpr const char* kRelations = "_rels/.rels";
    constexpr std::string_view kModel = "/3dmodel";
    if (archive_.has(kRelations)) {
      load(kRelations);
      for (const pugi::xml_node relation : document_.document_element().children()) {
        std::string target = relation.attribute("Target").value();
        if (target.starts_with("/")) target.erase(0, 1);
        if (std::string_view(relation.attribute("Type").value()).ends_with(kModel) && archive_.has(target))
          return target;
      }
    }
    for (const auto& [path, entry] : archive_.entries())
      if (lower_case(path).ends_with(".model")) return path;
    throw InputError(name_ + ": no 3MF file: there is no model in the archive");
  }

  void read_materials(const std::string& id, const pugi::xml_node& resource) {
    for (const pugi::xml_node base : resource.children("base"))
      materials_[id].push_back(base.attribute("name").value());
  }

  double number(const pugi::xml_node& node, const char* attribute) const {
    const auto value = parse_number(node.attribute(attribute).value());
    if (!value)
      fail(std::string("expected a number ") + attribute + ", found " + in_quotes(node.attribute(attribute).value()));
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
  void add_object(const std::string& id, const Transform& transform, const std::string& group, int depth) {
    constexpr int kMostDepth = 16;
    constexpr std::size_t kMostParts = 1 << 20;  // components of components could double with every level
    const auto found = objects_.find(id);
    if (found == objects_.end()) fail("there is no object " + in_quotes(id));
    if (depth > kMostDepth || ++num_parts_ > kMostParts) fail("components include themselves, or are far too many");
    const pugi::xml_node object = found->second;
    const std::string_view type = object.attribute("type").as_string("model");
    if (type == "support" || type == "other") return left_out_.add("objects of type " + std::string(type));
    const std::string own = object.attribute("name").value(), name = group.empty() ? own : group;
    if (const pugi::xml_node mesh = object.child("mesh")) add_mesh(object, mesh, transform, name);
    for (const pugi::xml_node component : object.child("components").children("component"))
      add_object(component.attribute("objectid").value(), transform * transform_of(component), name, depth + 1);
  }

  Index corner(const pugi::xml_node& triangle, const char* attribute, std::size_t first, std::size_t count) const {
    const auto value = parse_integer(triangle.attribute(attribute).value());
    if (!value || *value < 0 || static_cast<std::uint64_t>(*value) >= count)
      fail(std::string("expected the number of a vertex as ") + attribute + " of a triangle, found " +
           in_quotes(triangle.attribute(attribute).value()));
    return static_cast<Index>(first + static_cast<std::size_t>(*value));
  }

  void add_mesh(const pugi::xml_node& object, const pugi::xml_node& mesh, const Transform& transform,
                const std::string& name) {
    ++num_meshes_;
    const std::size_t first = mesh_.positions.size();
    for (const pugi::xml_node vertex : mesh.child("vertices").children("vertex"))
      mesh_.positions.push_back(transform * Vec3(number(vertex, "x"), number(vertex, "y"), number(vertex, "z")));
    const std::size_t count = mesh_.positions.size() - first;
    if (mesh_.positions.size() > static_cast<std::size_t>(std::numeric_limits<Index>::max()))
      fail("more vertices than an index can tell");
    const bool mirrors = transform.linear().determinant() < 0;
    const std::string pid = object.attribute("pid").value(), index = object.attribute("pindex").value();
    for (const pugi::xml_node triangle : mesh.child("triangles").children("triangle")) {
      const Index a = corner(triangle, "v1", first, count), b = corner(triangle, "v2", first, count),
                  c = corner(triangle, "v3", first, count);
      mesh_.face_vertices.insert(mesh_.face_vertices.end(), {a, mirrors ? c : b, mirrors ? b : c});
      mesh_.face_offsets.push_back(mesh_.face_vertices.size());
      materials_of_face_.push_back(material(triangle.attribute("pid").as_string(pid.c_str()),
                                            triangle.attribute("p1").as_string(index.c_str())));
      names_of_face_.push_back(place_of(name));
    }
  }

  /// Place of a name in the list of all names of objects; -1 for no name.
  int place_of(const std::string& name) {
    if (name.empty()) return -1;
    return object_names_.try_emplace(name, static_cast<int>(object_names_.size())).first->second;
  }

  const std::string* material(const std::string& pid, const std::string& index) const {
    const auto found = materials_.find(pid);
    const auto place = parse_integer(index);
    if (found == materials_.end() || !place || *place < 0 ||
        static_cast<std::size_t>(*place) >= found->second.size())
      return nullptr;
    const std::string& name = found->second[static_cast<std::size_t>(*place)];
    return name.empty() ? nullptr : &name;
  }

  /// Materials that tell faces apart are groups; else objects are, if there are several.
  void name_groups() {
    const auto has_several = [](const auto& list) {
      return std::any_of(list.begin(), list.end(), [&](const auto& entry) { return entry != list.front(); });
    };
    GroupList groups;
    std::vector<Index> of_face;
    if (has_several(materials_of_face_)) {
      for (const std::string* name : materials_of_face_) of_face.push_back(name ? groups.by_name(*name) : kNoIndex);
    } else if (num_meshes_ > 1 && has_several(names_of_face_)) {
      std::vector<std::string> names(object_names_.size());
      for (const auto& [name, place] : object_names_) names[static_cast<std::size_t>(place)] = name;
      for (const int place : names_of_face_)
        of_face.push_back(place < 0 ? kNoIndex : groups.by_name(names[static_cast<std::size_t>(place)]));
    }
    if (!of_face.empty()) mesh_.face_groups = {groups.take(), std::move(of_face)};
  }

  std::string name_, path_, text_;
  ZipArchive archive_;
  pugi::xml_document document_;
  std::map<std::string, pugi::xml_node> objects_;
  std::map<std::string, std::vector<std::string>> materials_;
  std::vector<const std::string*> materials_of_face_;  ///< names of materials, or null
  std::map<std::string, int> object_names_;
  std::vector<int> names_of_face_;
  PolygonMesh mesh_;
  LeftOut left_out_;
  std::size_t num_parts_ = 0, num_meshes_ = 0;
};

}  // namespace

ParsedSurface parse_3mf(const std::string& name, std::string_view bytes) { return ThreeMfParser(name, bytes).parse(); }

}  // namespace subvol::internal
