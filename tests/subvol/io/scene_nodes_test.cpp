// SPDX-License-Identifier: GPL-3.0-or-later
// Scenes whose nodes or elements would take all memory, or more than the stack, are refused before Assimp reads them.
#include "subvol/io/scene_nodes.h"
#include "subvol/base/error.h"

#include <catch2/catch.hpp>

using namespace subvol;
using namespace subvol::internal;
using Catch::Matchers::Contains;

namespace {

template <class Check>
std::string scene_refusal(const Check& require_sound, std::string_view bytes) {
  try {
    require_sound("a", bytes);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string repeated(const std::string& text, int times) {
  std::string result;
  for (int i = 0; i < times; ++i) result += text;
  return result;
}

std::string scene_of(const std::string& library, const std::string& nodes) {
  return "<COLLADA><library_nodes>" + library + "</library_nodes><library_visual_scenes><visual_scene id=\"s\">" +
         nodes + "</visual_scene></library_visual_scenes></COLLADA>";
}

std::string instance(const std::string& target) { return "<instance_node url=\"#" + target + "\"/>"; }

std::string node(const std::string& id, const std::string& content) {
  return "<node id=\"" + id + "\">" + content + "</node>";
}

std::string fbx_model(int id) {
  return "Model: " + std::to_string(id) + ", \"Model::\", \"Mesh\" {\nVersion: 232\n}\n";
}

std::string fbx_connection(int child, int parent, const std::string& property = "") {
  return (property.empty() ? "C: \"OO\"," : "C: \"OP\",") + std::to_string(child) + "," + std::to_string(parent) +
         (property.empty() ? "" : ", \"" + property + "\"") + "\n";
}

std::string fbx_text(const std::string& objects, const std::string& connections) {
  return "; a comment { { \" \nObjects: {\n" + objects + "}\nConnections :  {\n" + connections + "}\n";
}

std::string little(std::size_t value, std::size_t size) {
  std::string bytes;
  for (std::size_t i = 0; i < size; ++i) bytes += static_cast<char>(value >> (8 * i) & 255);
  return bytes;
}

/// An element of a binary FBX file that begins at a place. word: size of its places and counts.
std::string fbx_element(std::size_t at, std::size_t word, const std::string& key, const std::string& values,
                        std::size_t num_values, const std::vector<std::string>& content_at = {}) {
  const std::size_t head = 3 * word + 1 + key.size() + values.size();
  std::string content;
  for (const std::string& part : content_at) content += part;
  if (!content.empty()) content += std::string(3 * word + 1, '\0');
  return little(at + head + content.size(), word) + little(num_values, word) + little(values.size(), word) +
         little(key.size(), 1) + key + values + content;
}

std::string fbx_number(int id) { return "L" + little(static_cast<std::size_t>(id), 8); }
std::string fbx_word(const std::string& word) { return "S" + little(word.size(), 4) + word; }

/// A binary file with a model, below the scene and below itself if `is_cycle`.
std::string binary_fbx(int version, bool is_cycle) {
  const std::size_t word = version >= 7500 ? 8 : 4, header = 27;
  const auto head = [&](const std::string& key) { return 3 * word + 1 + key.size(); };
  const std::string model = fbx_element(header + head("Objects"), word, "Model", fbx_number(5) + fbx_word("m"), 2);
  std::string bytes = std::string("Kaydara FBX Binary  \0\x1a\0", 23) + little(static_cast<std::size_t>(version), 4);
  bytes += fbx_element(header, word, "Objects", "", 0, {model});
  const std::size_t begin = bytes.size() + head("Connections");
  const std::string first =
      fbx_element(begin, word, "C", fbx_word("OO") + fbx_number(5) + fbx_number(is_cycle ? 5 : 0), 3);
  const std::string second =
      fbx_element(begin + first.size(), word, "C", fbx_word("OO") + fbx_number(5) + fbx_number(0), 3);
  return bytes + fbx_element(bytes.size(), word, "Connections", "", 0, {first, second}) +
         std::string(3 * word + 1, '\0');
}

}  // namespace

TEST_CASE("Nodes of a scene may share others, but not hold themselves or make far too many", "[io][quick]") {
  CHECK_NOTHROW(require_sound_nodes("a", {{1, 2, 2}, {2}, {}}, 0));
  CHECK_THROWS_WITH(require_sound_nodes("a", {{1}, {2}, {1}}, 0), Contains("a: ") && Contains("child of itself"));
  SceneNodes chain(501), doubling(41);
  for (std::size_t i = 0; i + 1 < chain.size(); ++i) chain[i] = {i + 1};
  for (std::size_t i = 0; i + 1 < doubling.size(); ++i) doubling[i] = {i + 1, i + 1};
  CHECK_THROWS_WITH(require_sound_nodes("a", chain, 0), Contains("500 deep"));
  CHECK_NOTHROW(require_sound_nodes("a", chain, 1));
  CHECK_THROWS_WITH(require_sound_nodes("a", doubling, 0), Contains("repeat others"));
}

TEST_CASE("COLLADA whose nodes hold themselves, double, or are too deep in one another is refused", "[io][quick]") {
  const auto refusal = [](const std::string& library, const std::string& nodes) {
    return scene_refusal(require_sound_collada, scene_of(library, nodes));
  };
  CHECK(refusal(node("n", ""), node("a", instance("n") + instance("n")) + node("b", instance("n"))).empty());
  // A node may have the name of what it holds.
  CHECK(refusal(node("n", ""), "<node name=\"n\">" + instance("n") + "</node>").empty());
  for (const std::string& cycle : {refusal("", node("a", instance("a"))), refusal("", node("a", instance("s"))),
                                   refusal(node("n", instance("n")), node("a", instance("n"))),
                                   refusal(node("m", instance("n")) + node("n", node("k", instance("m"))), ""),
                                   refusal("", "<node name=\"a\">" + instance("a") + "</node>")})
    CHECK_THAT(cycle, Contains("child of itself"));
  std::string library;
  for (int i = 0; i < 40; ++i)
    library += node("n" + std::to_string(i), repeated(instance("n" + std::to_string(i + 1)), 2));
  CHECK_THAT(refusal(library + node("n40", ""), node("a", instance("n0"))), Contains("repeat others"));
  CHECK_THAT(refusal("", repeated("<node>", 600) + repeated("</node>", 600)), Contains("500 deep"));
  CHECK_THAT(refusal("", repeated("<extra>", 600) + repeated("</extra>", 600)), Contains("500 deep"));
  CHECK(scene_refusal(require_sound_collada, "no XML").empty());  // Assimp says why
}

TEST_CASE("COLLADA whose accessors reach beyond their arrays is refused", "[io][quick]") {
  const auto refusal = [](const std::string& array, const std::string& accessor) {
    return scene_refusal(require_sound_collada, "<COLLADA><source><float_array id=\"a\" " + array +
                                                    ">0 0 0 1 0 0 0 1 0</float_array><accessor source=\"#a\" " +
                                                    accessor +
                                                    "><param/><param/><param/></accessor></source></COLLADA>");
  };
  CHECK(refusal("count=\"9\"", "count=\"3\" stride=\"3\"").empty());
  CHECK(refusal("count=\"0\"", "count=\"0\" stride=\"3\"").empty());
  for (const char* accessor : {"count=\"4\" stride=\"3\"", "count=\"3\" stride=\"4\"",
                               "count=\"3\" stride=\"3\" offset=\"1\"", "count=\"-1\" stride=\"3\""})
    CHECK_THAT(refusal("count=\"9\"", accessor), Contains("beyond its array"));
  for (const char* array : {"", "count=\"8\"", "count=\"-1\""})
    CHECK_THAT(refusal(array, "count=\"3\" stride=\"3\""), Contains("beyond its array"));
  CHECK_THAT(refusal("count=\"4000000000\"", "count=\"3\" stride=\"3\""), Contains("too many"));
}

TEST_CASE("FBX whose models hold themselves, double, or are too deep in one another is refused", "[io][quick]") {
  const auto refusal = [](const std::string& objects, const std::string& connections) {
    return scene_refusal(require_sound_fbx, fbx_text(objects, connections));
  };
  const std::string both = fbx_model(2) + fbx_model(3), below_scene = fbx_connection(2, 0) + fbx_connection(3, 2);
  CHECK(refusal(both, below_scene).empty());
  CHECK(refusal(both, below_scene + fbx_connection(2, 3, "LookAtProperty")).empty());
  CHECK_THAT(refusal(both, below_scene + fbx_connection(2, 3)), Contains("child of itself"));
  CHECK(refusal("Material: 7, \"\" {\n}\n" + both, below_scene + fbx_connection(7, 3) + fbx_connection(3, 7)).empty());
  std::string models, doubling = fbx_connection(10, 0), chain = doubling;
  for (int i = 10; i < 600; ++i) {
    models += fbx_model(i);
    chain += fbx_connection(i + 1, i);
    if (i < 50) doubling += repeated(fbx_connection(i + 1, i), 2);
  }
  CHECK_THAT(refusal(models, doubling), Contains("repeat others"));
  CHECK_THAT(refusal(models, chain), Contains("500 deep"));
  CHECK_THAT(refusal(repeated("A: {\n", 600) + repeated("}\n", 600), ""), Contains("500 deep"));
  for (const int version : {7400, 7500}) {
    CHECK(scene_refusal(require_sound_fbx, binary_fbx(version, false)).empty());
    const std::string cycle = binary_fbx(version, true);
    CHECK_THAT(scene_refusal(require_sound_fbx, cycle), Contains("child of itself"));
    for (std::size_t size = 0; size < cycle.size(); ++size)
      CHECK_NOTHROW(scene_refusal(require_sound_fbx, std::string_view(cycle).substr(0, size)));
  }
}
