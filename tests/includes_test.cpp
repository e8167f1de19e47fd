// SPDX-License-Identifier: GPL-3.0-or-later
// The layers only point down: docs/architecture.md, "Who may include whom".

#include "tests/support/data.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace fs = std::filesystem;

namespace {

const fs::path kRoot = subvol::test::source_dir();
const std::vector<std::string> kLayers{"subvol", "fit",     "shell", "export", "cli",
                                       "python", "samples", "bench", "tests"};

const std::map<std::string, std::set<std::string>> kMayInclude{
    {"subvol", {"subvol"}},
    {"fit", {"subvol", "fit"}},
    {"shell", {"subvol", "fit", "shell"}},
    {"export", {"subvol", "export"}},  // and kFitForExport
    {"cli", {"subvol", "fit", "shell", "export", "cli"}},
    {"python", {"subvol", "fit", "shell", "export", "cli", "python"}},
    {"samples", {"subvol", "fit", "shell", "export", "samples"}},
    {"bench", {"subvol", "fit", "shell", "export", "samples", "bench"}},
    {"tests", {"subvol", "fit", "shell", "export", "cli", "samples", "tests"}},
};
// Results of a fit may be shown, its energies and solver not.
const std::set<std::string> kFitForExport{"fit/quality/quality.h", "fit/certificate/certificate.h", "fit/elements/element_space.h",
                                          "fit/elements/high_order_mesh.h", "fit/elements/pattern_table.h",
                                          "fit/quality/high_order_quality.h", "fit/geometry/curved_boundary.h",
                                          "fit/elements/boundary_samples.h"};

struct Source {
  std::string path, layer;
  std::vector<std::string> includes;
};

std::vector<std::string> includes_of(const fs::path& file) {
  std::vector<std::string> found;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with("#include ")) continue;
    const auto open = line.find_first_of("\"<"), close = line.find_last_of("\">");
    found.push_back(line.substr(open + 1, close - open - 1));
  }
  return found;
}

std::vector<Source> all_sources() {
  std::vector<Source> sources;
  for (const std::string& layer : kLayers) {
    if (!fs::exists(kRoot / layer)) continue;
    for (const auto& entry : fs::directory_iterator(kRoot / layer)) {
      const auto extension = entry.path().extension();
      if (extension != ".h" && extension != ".cpp") continue;
      sources.push_back({layer + '/' + entry.path().filename().string(), layer, includes_of(entry.path())});
    }
  }
  std::sort(sources.begin(), sources.end(), [](const Source& a, const Source& b) { return a.path < b.path; });
  return sources;
}

std::string layer_of(const std::string& include) {
  const std::string folder = include.substr(0, include.find('/'));
  return std::find(kLayers.begin(), kLayers.end(), folder) != kLayers.end() ? folder : "";
}

}  // namespace

TEST_CASE("Files include only their own layer and those below", "[includes]") {
  const auto sources = all_sources();
  REQUIRE(sources.size() > 20);
  for (const Source& source : sources) {
    for (const std::string& include : source.includes) {
      const std::string layer = layer_of(include);
      if (layer.empty() || kMayInclude.at(source.layer).count(layer)) continue;
      if (source.layer == "export" && kFitForExport.count(include)) continue;
      FAIL_CHECK(source.path << " includes " << include);
    }
  }
}

TEST_CASE("CGAL, OpenSubdiv and tinygltf stay inside their .cpp files, pybind11 in its folder", "[includes]") {
  for (const Source& source : all_sources()) {
    if (source.layer == "tests") continue;
    for (const std::string& include : source.includes) {
      INFO(source.path << " includes " << include);
      if (include.starts_with("CGAL/")) CHECK(source.path.ends_with("_cgal.cpp"));
      if (include.starts_with("opensubdiv/")) CHECK(source.path.ends_with(".cpp"));
      if (include.starts_with("tiny_gltf")) CHECK(source.path.ends_with(".cpp"));
      if (include.starts_with("pybind11/")) CHECK(source.layer == "python");
    }
  }
}

TEST_CASE("No header includes itself through others", "[includes]") {
  std::map<std::string, std::vector<std::string>> graph;
  for (const Source& source : all_sources()) graph[source.path] = source.includes;
  enum class State { fresh, open, done };
  std::map<std::string, State> states;
  const std::function<void(const std::string&)> visit = [&](const std::string& path) {
    if (!graph.count(path) || states[path] == State::done) return;
    if (states[path] == State::open) {
      FAIL_CHECK("a cycle of includes through " << path);
      return;
    }
    states[path] = State::open;
    for (const std::string& include : graph[path]) visit(include);
    states[path] = State::done;
  };
  for (const auto& [path, includes] : graph) visit(path);
}

TEST_CASE("Every source says its licence in the first line", "[includes]") {
  for (const Source& source : all_sources()) {
    std::ifstream stream(kRoot / source.path);
    std::string first;
    std::getline(stream, first);
    INFO(source.path);
    CHECK(first == "// SPDX-License-Identifier: GPL-3.0-or-later");
  }
}
