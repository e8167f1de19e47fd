// SPDX-License-Identifier: GPL-3.0-or-later
// The rooms only point down: docs/architecture.md, "Rooms".

#include "tests/support/data.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace fs = std::filesystem;

namespace {

/// A folder whose files belong together, and what these may include besides one another: rooms with all rooms inside
/// them, or single headers.
struct Room {
  std::string folder;
  std::vector<std::string> may_include;
};

/// Lowest first: a room may include only rooms before it.
const std::vector<Room> kRooms{
    {"subvol/base", {}},
    {"subvol/mesh", {"subvol/base"}},
    {"subvol/surface", {"subvol/base", "subvol/mesh"}},
    {"subvol/io", {"subvol/base", "subvol/mesh", "subvol/surface"}},
    {"subvol/subdivision", {"subvol/base", "subvol/mesh", "subvol/surface"}},
    {"subvol/templates", {"subvol/base", "subvol/mesh", "subvol/surface"}},
    {"fit/tuning", {"subvol"}},
    {"fit/simd", {"subvol"}},
    {"fit/elements", {"subvol", "fit/simd"}},
    {"fit/certificate", {"subvol", "fit/simd", "fit/elements"}},
    {"fit/quality", {"subvol", "fit/elements", "fit/certificate"}},
    {"fit/geometry", {"subvol", "fit/simd"}},
    {"fit/target", {"subvol", "fit/tuning", "fit/geometry"}},
    {"fit/mending", {"subvol", "fit/geometry", "fit/target"}},
    {"fit/features", {"subvol", "fit/tuning", "fit/geometry"}},
    {"fit/energies",
     {"subvol", "fit/tuning", "fit/simd", "fit/elements", "fit/certificate", "fit/geometry", "fit/target",
      "fit/features"}},
    {"fit/solver", {"subvol", "fit/tuning", "fit/elements", "fit/energies"}},
    {"fit/stages",
     {"subvol", "fit/tuning", "fit/certificate", "fit/geometry", "fit/target", "fit/features", "fit/energies",
      "fit/solver"}},
    {"fit/fits",
     {"subvol", "fit/tuning", "fit/elements", "fit/quality", "fit/geometry", "fit/target", "fit/features", "fit/solver",
      "fit/stages"}},
    {"fit", {"subvol"}},  // and every room of fit
    {"shell", {"subvol", "fit"}},
    // The result of a fit may be shown, but no energy, no solver and no fit.
    {"export", {"subvol", "fit/elements", "fit/quality", "fit/geometry/curved_boundary.h"}},
    {"cli/runs", {"subvol", "fit", "shell", "export"}},
    {"cli/batch", {"subvol", "cli/runs"}},
    {"cli/verbs", {"subvol", "fit", "shell", "export", "cli/runs", "cli/batch"}},
    {"python", {"subvol", "fit", "shell", "export", "cli/runs"}},
    {"samples", {"subvol", "fit", "shell", "export"}},
    {"bench", {"subvol", "fit", "shell", "export", "samples"}},
    {"tests", {"subvol", "fit", "shell", "export", "cli", "samples"}},
};

/// The folders whose headers make the library.
constexpr const char* kLibraryFolders[] = {"subvol", "fit", "shell", "export"};

/// A library of others, known by how its includes begin, and the files that may include it: those in these folders
/// whose names end so.
struct Library {
  std::string include;
  std::vector<std::string> folders;
  std::string ending;
};

const std::vector<Library> kLibraries{
    {"CGAL/", {"fit/geometry", "shell"}, "_cgal.cpp"},
    {"opensubdiv/", {"subvol/subdivision", "bench", "tests"}, ".cpp"},
    {"tiny_gltf", {"export", "subvol/io"}, ".cpp"},
    {"pugixml", {"subvol/io"}, "_pugixml.cpp"},
    {"zlib", {"subvol/io", "export", "tests"}, ".cpp"},
    {"lz4", {"subvol/io"}, ".cpp"},
    {"netcdf", {"subvol/io"}, "_netcdf.cpp"},
    {"assimp/", {"subvol/io"}, "_assimp.cpp"},
    {"cgnslib", {"subvol/io", "tests/subvol/io"}, "_cgns.cpp"},
    {"CLI/", {"cli/verbs"}, ""},
    {"pybind11/", {"python"}, ""},
};

struct Source {
  std::string path;                       ///< from the root of the project
  std::vector<std::string> includes;      ///< of files of ours: "..."
  std::vector<std::string> libraries{};   ///< of others' files: <...>
  std::vector<std::string> namespaces{};  ///< named ones that are opened at the beginning of a line
};

/// Path from the root of the project of a header of the library, which is included as it is installed.
std::string path_of(const std::string& include) {
  for (const char* folder : {"fit/", "shell/", "export/"})
    if (include.starts_with(std::string("subvol/") + folder)) return include.substr(std::string_view("subvol/").size());
  return include;
}

/// Whether a path is this file, or is in this folder or in one inside it.
bool is_in(std::string_view path, std::string_view place) {
  return path.starts_with(place) && (path.size() == place.size() || path[place.size()] == '/');
}

std::string folder_of(const std::string& path) { return path.substr(0, path.rfind('/')); }

/// The innermost room of a file; null: it has none. A room that is made of rooms holds only files of its own.
const Room* room_of(const std::string& path) {
  const Room* found = nullptr;
  for (const Room& room : kRooms)
    if (is_in(path, room.folder) && (!found || room.folder.size() > found->folder.size())) found = &room;
  return found && found->folder == "fit" && folder_of(path) != "fit" ? nullptr : found;
}

// --- The checks: each lists what is wrong with the sources -----------------------------------------------------------

std::vector<std::string> files_without_room(const std::vector<Source>& sources) {
  std::vector<std::string> wrong;
  for (const Source& source : sources)
    if (!room_of(source.path)) wrong.push_back(source.path + " is in no room");
  return wrong;
}

std::vector<std::string> upward_includes(const std::vector<Source>& sources) {
  std::vector<std::string> wrong;
  for (const Source& source : sources) {
    const Room* room = room_of(source.path);
    if (!room) continue;
    for (const std::string& include : source.includes) {
      const auto has_it = [&](const std::string& place) { return is_in(include, place); };
      const auto& places = room->may_include;
      if (!has_it(room->folder) && std::none_of(places.begin(), places.end(), has_it))
        wrong.push_back(source.path + " includes " + include);
    }
  }
  return wrong;
}

std::vector<std::string> stray_libraries(const std::vector<Source>& sources) {
  std::vector<std::string> wrong;
  for (const Source& source : sources)
    for (const std::string& include : source.libraries)
      for (const Library& library : kLibraries) {
        const auto has_it = [&](const std::string& folder) { return is_in(source.path, folder); };
        if (include.starts_with(library.include) &&
            (std::none_of(library.folders.begin(), library.folders.end(), has_it) ||
             !source.path.ends_with(library.ending)))
          wrong.push_back(source.path + " includes " + include);
      }
  return wrong;
}

std::vector<std::string> cycles(const std::vector<Source>& sources) {
  std::map<std::string, std::vector<std::string>> graph;
  for (const Source& source : sources) graph[source.path] = source.includes;
  enum class State { fresh, open, done };
  std::map<std::string, State> states;
  std::vector<std::string> wrong, way;
  const std::function<void(const std::string&)> visit = [&](const std::string& path) {
    if (!graph.count(path) || states[path] == State::done) return;
    way.push_back(path);
    if (states[path] == State::open) {
      std::string cycle;
      for (auto at = std::find(way.begin(), way.end(), path); at != way.end(); ++at)
        cycle += (cycle.empty() ? "" : " -> ") + *at;
      wrong.push_back(cycle);
    } else {
      states[path] = State::open;
      for (const std::string& include : graph[path]) visit(include);
      states[path] = State::done;
    }
    way.pop_back();
  };
  for (const auto& [path, includes] : graph) visit(path);
  return wrong;
}

/// Includes of files that are not there by this name: each is to be named from the root of the project, and those of
/// the library as they are installed.
std::vector<std::string> unknown_files(const std::vector<Source>& sources) {
  constexpr std::string_view kMadeByCMake = "subvol/version_macros.h";
  std::vector<std::string> wrong;
  for (const Source& source : sources)
    for (const std::string& include : source.includes)
      if (include != kMadeByCMake &&
          std::none_of(sources.begin(), sources.end(), [&](const Source& other) { return other.path == include; }))
        wrong.push_back(source.path + " includes " + include);
  return wrong;
}

/// The entry points and all headers that these include.
std::set<std::string> public_headers(const std::vector<Source>& sources, const std::vector<std::string>& entry_points) {
  std::set<std::string> found;
  std::vector<std::string> open = entry_points;
  while (!open.empty()) {
    const std::string header = open.back();
    open.pop_back();
    if (!found.insert(header).second) continue;
    for (const Source& source : sources)
      if (source.path == header) open.insert(open.end(), source.includes.begin(), source.includes.end());
  }
  return found;
}

/// Headers of the library that are public and open none but subvol::internal, or that are not and open another.
std::vector<std::string> misplaced_names(const std::vector<Source>& sources,
                                         const std::vector<std::string>& entry_points) {
  const std::set<std::string> is_public = public_headers(sources, entry_points);
  std::vector<std::string> wrong;
  for (const Source& source : sources) {
    const auto has_it = [&](const char* folder) { return is_in(source.path, folder); };
    if (!source.path.ends_with(".h") || std::ranges::none_of(kLibraryFolders, has_it)) continue;
    const bool opens_public =
        std::ranges::any_of(source.namespaces, [](const std::string& name) { return name == "subvol"; });
    if (opens_public != is_public.contains(source.path))
      wrong.push_back(source.path + (opens_public ? " is not public, and not in subvol::internal"
                                                  : " is public, and in subvol::internal"));
  }
  return wrong;
}

// --- The sources of the project --------------------------------------------------------------------------------------

Source read_source(const fs::path& root, const fs::path& file) {
  Source source{fs::relative(file, root).generic_string(), {}};
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    constexpr std::string_view kNamespace = "namespace ";
    if (line.starts_with(kNamespace))
      source.namespaces.push_back(line.substr(kNamespace.size(), line.find(" {") - kNamespace.size()));
    if (!line.starts_with("#include ")) continue;
    const auto open = line.find_first_of("\"<"), close = line.find_last_of("\">");
    const std::string name = line.substr(open + 1, close - open - 1);
    if (line[open] == '"' || name.starts_with("subvol/"))
      source.includes.push_back(path_of(name));
    else
      source.libraries.push_back(name);
  }
  return source;
}

std::vector<Source> all_sources() {
  const fs::path root = subvol::test::source_dir();
  std::vector<Source> sources;
  for (const char* top : {"subvol", "fit", "shell", "export", "cli", "python", "samples", "bench", "tests"})
    for (const auto& entry : fs::recursive_directory_iterator(root / top))
      if (entry.path().extension() == ".h" || entry.path().extension() == ".cpp")
        sources.push_back(read_source(root, entry.path()));
  std::sort(sources.begin(), sources.end(), [](const Source& a, const Source& b) { return a.path < b.path; });
  return sources;
}

/// The entry points that cmake/SubvolHeaders.cmake lists.
std::vector<std::string> entry_points() {
  std::ifstream stream(fs::path(subvol::test::source_dir()) / "cmake" / "SubvolHeaders.cmake");
  std::vector<std::string> found;
  for (std::string line; std::getline(stream, line);) {
    if (line.ends_with(')')) line.pop_back();
    if (line.starts_with("  ") && line.ends_with(".h") && line.find(' ', 2) == std::string::npos)
      found.push_back(line.substr(2));
  }
  return found;
}

using Strings = std::vector<std::string>;

}  // namespace

TEST_CASE("Every source is in a room, and every room has sources", "[includes]") {
  const auto sources = all_sources();
  CHECK(files_without_room(sources) == Strings{});
  for (const Room& room : kRooms) {
    INFO(room.folder);
    CHECK(std::any_of(sources.begin(), sources.end(), [&](const Source& s) { return room_of(s.path) == &room; }));
  }
}

TEST_CASE("Rooms may include only rooms before them", "[includes]") {
  for (std::size_t i = 0; i < kRooms.size(); ++i)
    for (const std::string& place : kRooms[i].may_include)
      for (std::size_t above = i; above < kRooms.size(); ++above) {
        INFO(kRooms[i].folder << " may include " << place);
        CHECK(!is_in(kRooms[above].folder, place));
      }
}

TEST_CASE("Every room is described in docs/architecture.md", "[includes]") {
  std::ifstream stream(fs::path(subvol::test::source_dir()) / "docs" / "architecture.md");
  Strings rows;
  for (std::string line; std::getline(stream, line);)
    if (line.starts_with("| `")) rows.push_back(line.substr(3, line.find('`', 3) - 3));
  Strings folders;
  for (const Room& room : kRooms) folders.push_back(room.folder);
  CHECK(rows == folders);
}

TEST_CASE("Files include only what their room may", "[includes]") {
  CHECK(upward_includes(all_sources()) == Strings{});
}

TEST_CASE("Libraries of others are included only where they belong", "[includes]") {
  CHECK(stray_libraries(all_sources()) == Strings{});
}

TEST_CASE("No header includes itself through others", "[includes]") { CHECK(cycles(all_sources()) == Strings{}); }

TEST_CASE("What is not public is in subvol::internal", "[includes]") {
  CHECK(entry_points().size() > 50);
  CHECK(misplaced_names(all_sources(), entry_points()) == Strings{});
}

TEST_CASE("Every file that is included is named from the root", "[includes]") {
  CHECK(unknown_files(all_sources()) == Strings{});
}

TEST_CASE("No source uses ranges that Clang 14 does not compile", "[includes]") {
  const std::string ranges = "std::ranges::", views = "std::views";
  const std::array returning_subranges{"unique(", "remove(", "remove_if(",   "partition(", "stable_partition(",
                                       "rotate(", "search(", "equal_range(", "find_end(",  "find_last("};
  for (const Source& source : all_sources()) {
    std::ifstream stream(fs::path(subvol::test::source_dir()) / source.path);
    const std::string text(std::istreambuf_iterator<char>(stream), {});
    INFO(source.path);
    CHECK(text.find(views + "::") == std::string::npos);
    for (const char* algorithm : returning_subranges) CHECK(text.find(ranges + algorithm) == std::string::npos);
  }
}

TEST_CASE("Every source says its license in the first line", "[includes]") {
  for (const Source& source : all_sources()) {
    std::ifstream stream(fs::path(subvol::test::source_dir()) / source.path);
    std::string first;
    std::getline(stream, first);
    INFO(source.path);
    CHECK(first == "// SPDX-License-Identifier: GPL-3.0-or-later");
  }
}

TEST_CASE("The checks of includes report what is wrong", "[includes]") {
  SECTION("a file in no room") {
    CHECK(files_without_room({{"fit/attic/old.h", {}}, {"subvol/lost.h", {}}, {"fit/optimize_mesh.h", {}}}) ==
          Strings{"fit/attic/old.h is in no room", "subvol/lost.h is in no room"});
  }
  SECTION("an include of a room above, and of one beside") {
    CHECK(upward_includes({{"fit/target/fit_target.h", {"fit/geometry/closest_point.h", "fit/stages/fit_report.h"}},
                           {"subvol/io/mesh_io.cpp", {"subvol/templates/carve.h"}},
                           {"subvol/base/types.h", {"cli/runs/report.h"}}}) ==
          Strings{"fit/target/fit_target.h includes fit/stages/fit_report.h",
                  "subvol/io/mesh_io.cpp includes subvol/templates/carve.h",
                  "subvol/base/types.h includes cli/runs/report.h"});
  }
  SECTION("an include of an entry point by a room of fit") {
    CHECK(upward_includes({{"fit/fits/fit_level.h", {"fit/subdivision_fit.h"}}}).size() == 1);
    CHECK(upward_includes({{"fit/subdivision_fit.h", {"fit/fits/fit_level.h"}}}).empty());
  }
  SECTION("a header of fit that export may not see, beside one that it may") {
    CHECK(upward_includes({{"export/scene.h", {"fit/geometry/curved_boundary.h", "fit/geometry/closest_point.h"}}}) ==
          Strings{"export/scene.h includes fit/geometry/closest_point.h"});
  }
  SECTION("verbs in the Python module") {
    CHECK(upward_includes({{"python/fits.cpp", {"cli/runs/report.h", "cli/verbs/commands.h"}}}) ==
          Strings{"python/fits.cpp includes cli/verbs/commands.h"});
  }
  SECTION("a folder whose name only begins like a room's") {
    CHECK(upward_includes({{"fit/simd/wide.h", {"subvolume/types.h"}}}).size() == 1);
  }
  SECTION("a cycle, once") {
    CHECK(cycles({{"a.h", {"b.h"}}, {"b.h", {"c.h"}}, {"c.h", {"b.h"}}, {"d.h", {"a.h"}}}) ==
          Strings{"b.h -> c.h -> b.h"});
    CHECK(cycles({{"a.h", {"a.h"}}}) == Strings{"a.h -> a.h"});
    CHECK(cycles({{"a.h", {"b.h", "c.h"}}, {"b.h", {"c.h"}}, {"c.h", {}}}).empty());
  }
  SECTION("libraries outside their place") {
    CHECK(stray_libraries({{"fit/geometry/self_intersection.h", {}, {"CGAL/box_intersection_d.h"}},
                           {"subvol/io/read_cgal.cpp", {}, {"CGAL/IO/OFF.h"}},
                           {"fit/geometry/self_intersection_cgal.cpp", {}, {"CGAL/box_intersection_d.h", "vector"}},
                           {"subvol/subdivision/limit_surface.h", {}, {"opensubdiv/far/topologyRefiner.h"}},
                           {"fit/fits/fit_level.cpp", {}, {"opensubdiv/far/topologyRefiner.h"}},
                           {"cli/runs/writing.cpp", {}, {"tiny_gltf.h"}},
                           {"cli/runs/report.h", {}, {"CLI/CLI.hpp"}},
                           {"cli/verbs/main.cpp", {}, {"CLI/CLI.hpp"}},
                           {"cli/runs/loading.cpp", {}, {"pybind11/pybind11.h"}}}) ==
          Strings{"fit/geometry/self_intersection.h includes CGAL/box_intersection_d.h",
                  "subvol/io/read_cgal.cpp includes CGAL/IO/OFF.h",
                  "subvol/subdivision/limit_surface.h includes opensubdiv/far/topologyRefiner.h",
                  "fit/fits/fit_level.cpp includes opensubdiv/far/topologyRefiner.h",
                  "cli/runs/writing.cpp includes tiny_gltf.h", "cli/runs/report.h includes CLI/CLI.hpp",
                  "cli/runs/loading.cpp includes pybind11/pybind11.h"});
  }
  SECTION("names on the wrong side") {
    CHECK(misplaced_names({{"fit/a.h", {"fit/b.h"}, {}, {"subvol"}},
                           {"fit/b.h", {}, {}, {"subvol::internal"}},
                           {"fit/c.h", {}, {}, {"subvol"}},
                           {"fit/d.h", {}, {}, {"pugi", "subvol::internal"}},
                           {"cli/runs/report.h", {}, {}, {"subvol::cli"}}},
                          {"fit/a.h"}) ==
          Strings{"fit/b.h is public, and in subvol::internal", "fit/c.h is not public, and not in subvol::internal"});
  }
  SECTION("a file that is not named from the root") {
    CHECK(unknown_files({{"tests/support/data.h", {}}, {"tests/main.cpp", {"data.h", "tests/support/data.h"}}}) ==
          Strings{"tests/main.cpp includes data.h"});
  }
}
