// SPDX-License-Identifier: GPL-3.0-or-later
// Names of folders, shards, and what identifies the work of a model.

#include "cli/batch/batch_model.h"
#include "cli/batch/model_files.h"
#include "cli/runs/exit_status.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <chrono>
#include <set>
#include <string>
#include <vector>

using namespace subvol::cli;
using subvol::test::TemporaryFolder;
namespace fs = std::filesystem;

TEST_CASE("Folders of models have plain and distinct names", "[cli][batch]") {
  CHECK(folder_name("parts/bone-1.off") == "parts+bone-1.off");
  CHECK(folder_name("a+b c") == "a=2Bb=20c");
  CHECK(folder_name("..") == "=2E.");
  CHECK(folder_name(".hidden") == "=2Ehidden");
  CHECK(folder_name("\xC3\xA9") == "=C3=A9");
  const std::string longest(300, 'x');
  CHECK(folder_name(longest).size() < 200);
  CHECK(folder_name(longest) != folder_name(longest + "y"));
  std::set<std::string> names;
  const std::vector<std::string> ids{"a/b", "a+b", "a=2Bb", "a b", "a", "A", "a/b/", "a//b"};
  for (const std::string& id : ids) names.insert(folder_name(id));
  CHECK(names.size() == ids.size());
}

TEST_CASE("Each model is in one shard, whatever models there are, and shards are of about equal size", "[cli][batch]") {
  constexpr std::uint32_t kCount = 8, kModels = 8000;
  std::vector<int> sizes(kCount);
  for (std::uint32_t i = 0; i < kModels; ++i) {
    int holders = 0;
    for (std::uint32_t k = 1; k <= kCount; ++k)
      if (Shard{k, kCount}.holds("model" + std::to_string(i))) ++holders, ++sizes[k - 1];
    REQUIRE(holders == 1);
  }
  for (const int size : sizes) CHECK(std::abs(size - 1000) < 150);  // about five standard deviations
  // Shards are an agreement between machines: this hash does not change.
  CHECK(id_hash("bone") % 8 == id_hash(std::string("bo") + "ne") % 8);
  CHECK(parse_shard("3/8").number == 3);
  CHECK(parse_shard("1/1").count == 1);
  for (const char* wrong : {"0/8", "9/8", "3", "/", "a/b", "1/0", "-1/8", "1/8/2", ""})
    CHECK_THROWS_AS(parse_shard(wrong), UsageError);
}

TEST_CASE("Outputs are named by their part and extension", "[cli][batch]") {
  CHECK(output_file("mesh") == "result.mesh");
  CHECK(output_word("mesh") == "result.mesh");
  CHECK(output_file("cage:glb") == "cage.glb");
  CHECK(output_word("cage:glb") == "cage:cage.glb");
}

TEST_CASE("The words of a model name its files, outputs and report", "[cli][batch]") {
  const BatchVerb fit{{"template", "auto"}, {"--output", "--report", "--quiet", "--target"}};
  const BatchModel model{"x", "template auto", "a.off", {"--target", "b.off"}, {"mesh", "boundary:vtu"}};
  const auto words =
      model_words(model, fit, [](const std::string& word) { return word == "--target" ? word : "/" + word; });
  CHECK(words == std::vector<std::string>{"template", "auto", "/a.off", "--target", "/b.off", "-o", "result.mesh", "-o",
                                          "boundary:boundary.vtu", "--report", "report.json", "--quiet"});
}

TEST_CASE("The hash of a model's files covers the input and files of options, not their times", "[cli][batch]") {
  const TemporaryFolder folder;
  folder.file("a.off", "surface");
  folder.file("t.mesh", "template");
  const std::vector<fs::path> folders{folder.path()};
  const BatchModel model{"x", "fit", "a.off", {"--template", "t.mesh", "--cells", "30", "--target=t.mesh"}, {}};
  const auto hash = [&] { return FileHasher(folders).hash(model); };
  const ModelFiles first = hash();
  CHECK(first.hash == hash().hash);
  CHECK(first.stamp.empty());  // the files are new: their times may not tell the next change
  const auto old = fs::last_write_time(folder.path() / "a.off") - std::chrono::hours(1);
  for (const char* name : {"a.off", "t.mesh"}) fs::last_write_time(folder.path() / name, old);
  const ModelFiles aged = hash();
  CHECK(aged.hash == first.hash);
  CHECK_FALSE(aged.stamp.empty());
  CHECK(aged.stamp == FileHasher(folders).stamp(model));
  folder.file("t.mesh", "templatf");
  CHECK(hash().hash != first.hash);
  CHECK(FileHasher(folders).stamp(model) != aged.stamp);
  folder.file("t.mesh", "template");
  CHECK(hash().hash == first.hash);
  fs::remove(folder.path() / "a.off");
  CHECK(hash().hash != first.hash);
}

TEST_CASE("Words that name files become absolute, others stay", "[cli][batch]") {
  const TemporaryFolder folder;
  folder.file("t.mesh", "");
  const std::vector<fs::path> folders{folder.path()};
  const FileHasher hasher(folders);
  const BatchModel model{"x", "fit", "missing.off", {}, {}};
  const std::string base = folder.path().string();
  CHECK(hasher.absolute(model, "t.mesh") == base + "/t.mesh");
  CHECK(hasher.absolute(model, "--template=t.mesh") == "--template=" + base + "/t.mesh");
  CHECK(hasher.absolute(model, "missing.off") == base + "/missing.off");
  for (const char* word : {"--template", "300", "no.mesh", "--cells=3", "-1"})
    CHECK(hasher.absolute(model, word) == word);
}

TEST_CASE("What a model asks for has another hash if a word, an output or the program differs", "[cli][batch]") {
  const BatchModel model{"x", "fit", "a.off", {"--cells", "30"}, {"mesh"}};
  std::set<std::string> hashes{options_hash(model, "")};
  BatchModel other = model;
  other.id = "y";
  CHECK(hashes.count(options_hash(other, "")) == 1);  // another name is not another work
  other = model, other.options = {"--cells", "31"}, hashes.insert(options_hash(other, ""));
  other = model, other.options = {"--cells", "3", "0"}, hashes.insert(options_hash(other, ""));
  other = model, other.outputs = {"vtu"}, hashes.insert(options_hash(other, ""));
  other = model, other.verb = "check", hashes.insert(options_hash(other, ""));
  hashes.insert(options_hash(model, "nice"));
  CHECK(hashes.size() == 6);
}
