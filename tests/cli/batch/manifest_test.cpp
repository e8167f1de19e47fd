// SPDX-License-Identifier: GPL-3.0-or-later
// Tables, rows in JSON and patterns as the models of a batch.

#include "cli/batch/manifest.h"

#include "cli/batch/table_rows.h"
#include "cli/batch/words.h"
#include "cli/runs/exit_status.h"
#include "subvol/base/error.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <string>
#include <vector>

using namespace subvol::cli;
using subvol::InputError;
using subvol::test::TemporaryFolder;
using Strings = std::vector<std::string>;

namespace {

/// A verb that writes, and one that only checks.
const BatchVerb* find_verb(const std::string& name) {
  static const BatchVerb fit{{"fit"}, {"--cells", "--output", "--report", "--quiet", "--adaptive", "--box"}};
  static const BatchVerb check{{"check"}, {"--target", "--report", "--quiet"}};
  return name == "fit" ? &fit : name == "check" ? &check : nullptr;
}

BatchManifest models_in(const std::string& source, const ModelDefaults& defaults = {}) {
  return read_manifest(Strings{source}, {}, defaults, find_verb);
}

/// The message of the error with which a manifest of this name and content is refused.
std::string refusal(const std::string& name, const std::string& content) {
  const TemporaryFolder folder;
  const std::string path = folder.file(name, content).string();
  try {
    models_in(path);
  } catch (const InputError& error) {
    return std::string(error.what()).substr(path.size() - name.size());
  }
  return "accepted";
}

}  // namespace

TEST_CASE("Words are parted at blanks outside of quotes", "[cli][batch]") {
  CHECK(split_words("  --cells 300\t--quality  0.3 ") == Strings{"--cells", "300", "--quality", "0.3"});
  CHECK(split_words("--target 'my part.off' \"it's\" ''") == Strings{"--target", "my part.off", "it's", ""});
  CHECK(split_words("a'b c'd") == Strings{"ab cd"});
  CHECK(split_words("").empty());
  CHECK_THROWS_AS(split_words("'open"), InputError);
}

TEST_CASE("Rows of a table keep quoted separators, quotes and line ends", "[cli][batch]") {
  TableRows rows("t.csv", "\xEF\xBB\xBFid,input\r\n\r\n\"a,b\",\"say \"\"x\"\"\"\n\"two\nlines\",\nlast,z", ',');
  Strings fields;
  REQUIRE(rows.next(fields));
  CHECK(fields == Strings{"id", "input"});
  REQUIRE(rows.next(fields));
  CHECK(fields == Strings{"a,b", "say \"x\""});
  CHECK(rows.line() == 3);
  REQUIRE(rows.next(fields));
  CHECK(fields == Strings{"two\nlines", ""});
  REQUIRE(rows.next(fields));
  CHECK(fields == Strings{"last", "z"});
  CHECK(rows.line() == 6);
  CHECK_FALSE(rows.next(fields));
  TableRows open("t.csv", "a\n\"open", ',');
  open.next(fields);
  CHECK_THROWS_WITH(open.next(fields), "t.csv:2: expected another \" to end the field");
  TableRows behind("t.csv", "\"a\"b", ',');
  CHECK_THROWS_WITH(behind.next(fields), "t.csv:1: expected a separator after a field in quotes");
}

TEST_CASE("A table's columns are the parts of a model or options by their names", "[cli][batch]") {
  const TemporaryFolder folder;
  const auto path = folder.file("m.csv",
                                "id,input,verb,cells,--adaptive,options,outputs,#note\n"
                                "one,a.off,,300,true,--box '0 1',vtu cage:glb,x\n"
                                ",b.off,check,,false,,,\n");
  const ModelDefaults defaults{.options = {"--cells", "9"}, .outputs = {"mesh"}};
  CHECK_THROWS_WITH(models_in(path.string(), defaults), Catch::Contains("m.csv:3: check has no option '--cells'"));
  const BatchManifest all = models_in(path.string());
  REQUIRE(all.models.size() == 2);
  const BatchModel& one = all.models[0];
  CHECK(one.id == "one");
  CHECK(one.verb == "fit");
  CHECK(one.options == Strings{"--cells", "300", "--adaptive", "--box", "0 1"});
  CHECK(one.outputs == Strings{"vtu", "cage:glb"});
  CHECK(all.folders[one.folder] == folder.path());
  CHECK(all.models[1].id == "b.off");
  CHECK(all.models[1].options.empty());
  CHECK(all.models[1].outputs.empty());  // check writes none
}

TEST_CASE("JSON lines and rows give the same models as tables", "[cli][batch]") {
  const TemporaryFolder folder;
  const auto path = folder.file("m.jsonl", R"({"id": "one", "input": "a.off", "cells": 300, "adaptive": true})"
                                           "\n\n"
                                           R"({"input": "b.off", "options": {"box": [0, 1.5], "cells": null}})"
                                           "\n"
                                           R"({"input": "c.off", "options": ["--cells", "7"], "outputs": "none"})");
  const auto models = models_in(path.string()).models;
  REQUIRE(models.size() == 3);
  CHECK(models[0].options == Strings{"--cells", "300", "--adaptive"});
  CHECK(models[1].options == Strings{"--box", "0", "1.5"});
  CHECK(models[1].outputs == Strings{"mesh"});
  CHECK(models[2].options == Strings{"--cells", "7"});
  CHECK(models[2].outputs.empty());
  const Strings rows{R"({"id": 7, "input": "d.off"})"};
  const BatchManifest row = read_manifest({}, rows, {}, find_verb);
  REQUIRE(row.models.size() == 1);
  CHECK(row.models[0].id == "7");
  CHECK(row.folders[row.models[0].folder] == ".");
}

TEST_CASE("Patterns are the files that match, in order", "[cli][batch]") {
  const TemporaryFolder folder;
  for (const char* name : {"b.off", "a.off", "c.stl"}) folder.file(name, "");
  const std::string pattern = (folder.path() / "*.off").string();
  const auto models = models_in(pattern).models;
  REQUIRE(models.size() == 2);
  CHECK(models[0].input == (folder.path() / "a.off").string());
  CHECK(models[1].id == (folder.path() / "b.off").string());
  CHECK_THROWS_AS(models_in((folder.path() / "*.obj").string()), InputError);
  CHECK_THROWS_AS(read_manifest({}, {}, {}, find_verb), UsageError);
}

TEST_CASE("A manifest that is not understood is refused with its line", "[cli][batch]") {
  CHECK(refusal("m.csv", "id,input\na,b,c\n") == "m.csv:2: expected 2 fields as in the first line, got 3");
  CHECK(refusal("m.csv", "id,file\na,b\n") == "m.csv:1: expected a column 'input' among the names of the first line");
  CHECK(refusal("m.csv", "").starts_with("m.csv: expected a first line"));
  CHECK(refusal("m.csv", "id,input\na,\n") == "m.csv:2: expected an 'input'");
  CHECK(refusal("m.csv", "input,cels\na,3\n").starts_with("m.csv:2: fit has no option '--cels'"));
  CHECK(refusal("m.csv", "input,verb\na,batch\n") == "m.csv:2: 'verb': there is no verb 'batch' for a batch");
  CHECK(
      refusal("m.csv", "input,options\na,-o x.mesh\n").starts_with("m.csv:2: -o: the batch gives this option itself"));
  CHECK(refusal("m.csv", "input,options\na,'open\n").starts_with("m.csv:2: column 'options': expected another '"));
  CHECK(refusal("m.csv", "input,verb,outputs\na,check,mesh\n") == "m.csv:2: 'outputs': check writes none");
  CHECK(refusal("m.jsonl", "{\"input\": \"a\"}\n[1]\n").starts_with("m.jsonl:2: expected an object in JSON"));
  CHECK(refusal("m.jsonl", "{\"input\": {}}\n") == "m.jsonl:1: 'input': expected a text or a number, got {}");
  CHECK(refusal("m.csv", "id,input\nx,a\ny,b\nx,c\n").find("the id 'x' is also that of the model at") !=
        std::string::npos);
  CHECK(refusal("m.jsonl", "{\"input\": \"a\", \"id\": \"\\ud800\"}\n").starts_with("m.jsonl:1: expected an object"));
}
