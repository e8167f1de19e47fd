// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/viewer_page.h"

#include "subvol/base/error.h"
#include "subvol/base/markup.h"
#include "subvol/export/packed_array.h"
#include "subvol/export/viewer_script.h"

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <stdexcept>

namespace subvol::internal {
namespace {

/// Text as JSON that may stand inside an element of HTML.
std::string script_string(const std::string& text) {
  const std::string json = nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  std::string result;
  for (const char c : json) {
    if (c == '<')
      result += "\\u003c";
    else
      result += c;
  }
  return result;
}

/// Writes the data of a page as one JSON object.
class Writer {
 public:
  explicit Writer(const ViewerContent& content) : content_(content) {
    if (content.meshes.empty()) throw InputError("viewer_page: expected at least one mesh");
    Eigen::AlignedBox3d box;
    for (const Vec3& x : content.meshes.front().points) box.extend(x);
    if (!box.isEmpty()) origin_ = box.center();
  }

  std::string run() {
    const auto flag = [](bool value) { return value ? "true" : "false"; };
    text_ = "{\"title\":" + script_string(content_.title) +
            ",\"origin\":" + nlohmann::json({origin_.x(), origin_.y(), origin_.z()}).dump();
    text_ += ",\"shown\":" + std::to_string(content_.shown);
    if (content_.is_timeline) text_ += ",\"is_timeline\":true";
    if (!content_.field.empty()) text_ += ",\"field\":" + script_string(content_.field);
    if (content_.limit) {
      text_ += ",\"limit_of\":" + std::to_string(content_.limit_of) + ",\"shows_limit\":" + flag(content_.shows_limit) +
               ",\"limit\":";
      add(*content_.limit);
    }
    if (content_.cage) {
      text_ += ",\"cage\":";
      add(*content_.cage);
    }
    if (content_.target) {
      text_ += std::string(",\"shows_target\":") + flag(content_.shows_target) + ",\"target\":";
      add(*content_.target);
    }
    text_ += ",\"meshes\":[";
    for (const ViewerMesh& mesh : content_.meshes) {
      if (text_.back() != '[') text_ += ',';
      add(mesh);
    }
    return text_ + "]}";
  }

 private:
  void add_points(const char* name, const std::vector<Vec3>& points) {
    constexpr double kLeastFloat32Size = 1e-30;  // below it, single precision runs out of digits
    std::vector<float> values;
    values.reserve(3 * points.size());
    double largest = 0;
    for (const Vec3& x : points) {
      if (!x.allFinite()) throw InputError("viewer_page: a position is not finite");
      const Vec3 placed = x - origin_;
      if (!placed.cast<float>().allFinite())
        throw InputError("viewer_page: positions: expected numbers in the range of float32");
      for (int k = 0; k < 3; ++k) values.push_back(static_cast<float>(placed[k]));
      largest = std::max(largest, placed.cwiseAbs().maxCoeff());
    }
    if (largest > 0 && largest < kLeastFloat32Size)
      throw InputError("viewer_page: positions: expected a size in the range of float32");
    add(name, std::span<const float>(values), 3);
  }
  void add(const char* name, std::span<const float> values, std::size_t stride) {
    text_ += std::string(",\"") + name + "\":";
    append_packed(text_, values, stride);
  }
  void add(const char* name, const std::vector<Index>& values, std::size_t stride) {
    text_ += std::string(",\"") + name + "\":";
    append_packed(text_, std::vector<std::uint32_t>(values.begin(), values.end()), stride);
  }

  void add(const ViewerSurface& surface) {
    text_ += "{\"intervals\":1";
    add_points("points", surface.points);
    std::vector<Index> triangles, wires;
    for (const auto& corners : surface.triangles) triangles.insert(triangles.end(), corners.begin(), corners.end());
    for (const auto& ends : surface.wires) wires.insert(wires.end(), ends.begin(), ends.end());
    add("triangles", triangles, 3);
    if (!wires.empty()) add("wires", wires, 2);
    if (!surface.values.empty()) add("values", std::span<const float>(surface.values), 1);
    text_ += '}';
  }

  void add(const ViewerMesh& mesh) {
    text_ += "{\"name\":" + script_string(mesh.name) + ",\"intervals\":" + std::to_string(mesh.intervals) +
             ",\"num_vertices\":" + std::to_string(mesh.num_vertices) +
             ",\"num_cells\":" + std::to_string(mesh.kinds.size()) + ",\"num_edges\":" + std::to_string(mesh.num_edges);
    const bool is_uniform =
        std::all_of(mesh.kinds.begin(), mesh.kinds.end(), [&](auto kind) { return kind == mesh.kinds.front(); });
    const std::size_t num_cells = std::max<std::size_t>(1, mesh.kinds.size());
    if (is_uniform)
      text_ += ",\"kind\":" + std::to_string(mesh.kinds.empty() ? 0 : mesh.kinds.front());
    else
      add("kinds", std::vector<Index>(mesh.kinds.begin(), mesh.kinds.end()), 1);
    add_points("points", mesh.points);
    // Cells often follow one another as rows of a grid: each corner is close to that of the cell before.
    add("corners", mesh.corners, mesh.corners.size() / num_cells);
    if (!mesh.edges.empty()) add("edges", mesh.edges, mesh.edges.size() / num_cells);
    if (!mesh.faces.empty()) add("faces", mesh.faces, mesh.faces.size() / num_cells);
    if (!mesh.inverted.empty()) add("inverted", mesh.inverted, 1);
    if (!mesh.undecided.empty()) add("undecided", mesh.undecided, 1);
    text_ += ",\"fields\":[";
    for (const ViewerField& field : mesh.fields) {
      if (field.values.size() != (field.is_on_points ? mesh.points.size() : mesh.kinds.size()))
        throw InputError("viewer_page: the field " + field.name + " has another number of values than its mesh");
      if (text_.back() != '[') text_ += ',';
      add(field);
    }
    text_ += "]}";
  }

  void add(const ViewerField& field) {
    constexpr const char* kMaps[] = {"quality", "scale", "regions"};
    text_ += "{\"name\":" + script_string(field.name) + ",\"label\":" + script_string(field.label) + ",\"map\":\"" +
             kMaps[static_cast<int>(field.colors)] + "\",\"on\":\"" + (field.is_on_points ? "points" : "cells") +
             "\",\"worst\":\"" + (field.is_high_worst ? "high" : "low") + "\",\"names\":{";
    for (const auto& [number, name] : field.region_names) {
      if (text_.back() != '{') text_ += ',';
      text_ += '"' + std::to_string(number) + "\":" + script_string(name);
    }
    text_ += '}';
    add("values", std::span<const float>(field.values), 1);
    text_ += '}';
  }

  const ViewerContent& content_;
  Vec3 origin_ = Vec3::Zero();
  std::string text_;
};

std::string element(const ViewerContent& content, const char* place) {
  if (!has_viewer()) throw std::logic_error("viewer_page: built without the viewer");
  std::string text = std::string("<div class=\"subvol-viewer ") + place +
                     "\"><noscript>The viewer needs JavaScript.</noscript>" + "<script type=\"application/json\">";
  text += Writer(content).run();
  text += "</script></div>\n<script>";
  text += viewer_script();
  return text + "</script>\n";
}

}  // namespace

bool has_viewer() { return !viewer_script().empty(); }

std::string viewer_element(const ViewerContent& content) { return element(content, "part"); }

std::string viewer_page(const ViewerContent& content) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<link rel=\"icon\" "
         "href=\"data:,\">\n"
         "<title>" +
         escaped_markup(content.title) + "</title>\n</head>\n<body>\n" + element(content, "page") +
         "</body>\n</html>\n";
}

}  // namespace subvol::internal
